#![allow(warnings, clippy::all)]
use std::time::Instant;
use dymlm_core::*; use dymlm_geometry::OrientedBox; use dymlm_objects::*; use dymlm_sim::{TrueObject, EstimatedObject, ObjectScoreConfig, score_objects};
struct R<'a>{b:&'a[u8],p:usize}
impl<'a> R<'a>{ fn n(&mut self)->usize{let v=u32::from_le_bytes(self.b[self.p..self.p+4].try_into().unwrap());self.p+=4;v as usize} fn f(&mut self)->f64{let v=f64::from_le_bytes(self.b[self.p..self.p+8].try_into().unwrap());self.p+=8;v} fn s(&mut self)->String{let n=self.n();let s=String::from_utf8(self.b[self.p..self.p+n].to_vec()).unwrap();self.p+=n;s}
 fn v3(&mut self)->[f64;3]{[self.f(),self.f(),self.f()]} fn pose(&mut self)->Pose{let t=self.v3();let q=[self.f(),self.f(),self.f(),self.f()];Pose::new(t,q).unwrap()} }
struct Face{id:u64,label:String,plane:Plane,area:f64,rings:Vec<Vec<[f64;3]>>, bb:[[f64;3];2]}
fn inside(ring:&[[f64;3]],p:[f64;3],a:usize,b:usize)->bool{let mut c=false;let mut j=ring.len()-1;for i in 0..ring.len(){let (x,y)=(ring[i],ring[j]);if (x[b]>p[b])!=(y[b]>p[b])&&p[a]<(y[a]-x[a])*(p[b]-x[b])/(y[b]-x[b])+x[a]{c=!c}j=i}c}
fn main(){
  let args:Vec<String>=std::env::args().skip(1).collect();
  let verbose=args.iter().any(|a|a=="-v");
  let names:Vec<&String>=args.iter().filter(|a|!a.starts_with('-')&&!a.contains('=')).collect();
  let all=["sitting_static","sitting_xyz","sitting_halfsphere","sitting_rpy","walking_static","walking_xyz","walking_halfsphere","walking_rpy"];
  let trace: Option<usize> = args.iter().find_map(|a| a.strip_prefix("trace=").map(|s|s.parse().unwrap()));
  println!("{:20} {:>7} {:>6} {:>4} {:>6} {:>7} {:>6}  ms med p95 max","sequence","recall","prec","dup","iou","centre","label");
  for name in all { if !names.is_empty()&&!names.iter().any(|n|n.as_str()==name){continue}
    let Ok(bytes)=std::fs::read(format!("/tmp/objcache/{name}.bin")) else {continue};
    let mut r=R{b:&bytes,p:0}; let frames=r.n(); let no=r.n(); let mut truth=vec![]; let mut shares=vec![];
    for _ in 0..no{let id=r.n();let l=r.s();let p=r.pose();let len=r.v3();let fv=r.n();let sh=r.f();truth.push(TrueObject::new(id,&l,OrientedBox::new(p,len).unwrap(),fv as u32));shares.push(sh);}
    let nf=r.n(); let mut faces=vec![]; for _ in 0..nf{let id=r.n();let label=r.s();let nn=r.v3();let d=r.f();let area=r.f();let k=r.n();let mut rings=vec![];for _ in 0..k{let m=r.n();rings.push((0..m).map(|_|r.v3()).collect::<Vec<_>>())}
      let mut bb=[[1e9f64;3],[-1e9f64;3]];for p in rings.iter().flatten(){for a in 0..3{bb[0][a]=bb[0][a].min(p[a]);bb[1][a]=bb[1][a].max(p[a])}}
      faces.push(Face{id:id as u64,label,plane:Plane::new(nn,d).unwrap(),area,rings,bb});}
    faces.retain(|f|f.area>0.08&&f.label.is_empty());
    let truth_planes=|p:[f64;3],reach:f64,out:&mut Vec<SupportPlane>|{ for f in &faces { if f.plane.signed_distance(p).abs()<=reach && (0..3).all(|a|p[a]>=f.bb[0][a]-reach&&p[a]<=f.bb[1][a]+reach) { let n=f.plane.normal(); let m=if n[2].abs()>0.5{(0,1)}else if n[0].abs()>0.5{(1,2)}else{(0,2)}; if f.rings.iter().any(|g|inside(g,p,m.0,m.1)) {out.push(SupportPlane::new(f.id,f.plane))} } } };
    let cam=PinholeCamera::new(640,480,525.,525.,319.5,239.5).unwrap();
    let mut config=ObjectConfig::default();
    for a in &args { if let Some((k,v))=a.split_once('=') { let b=|v:&str| if v=="off"{Switch::Off}else{Switch::On}; match k {
      "motion"=>config.association.motion=b(v),"shared"=>config.association.shared=b(v),"centroid"=>config.association.centroid=b(v),"projection"=>config.association.projection=b(v),
      "ttest"=>config.association.centroid_test=CentroidTest::OneSampleT,
      "rect"=>config.parameterization.fitter.rectangle=b(v),"support"=>config.parameterization.support=b(v),"forest"=>config.update.forest=b(v),"completion"=>config.update.completion=b(v),
      "trim"=>config.update.trim=v.parse().unwrap(),"mvs"=>config.update.min_voxel_share=v.parse().unwrap(),"thr"=>config.update.isolation_forest.threshold=v.parse().unwrap(),
      "voxel"=>config.update.voxel_size=v.parse().unwrap(),"tol"=>config.parameterization.plane_tolerance=v.parse().unwrap(),"sig"=>config.parameterization.plane_sigmas=v.parse().unwrap(),"samples"=>config.parameterization.max_samples=v.parse().unwrap(),"proj"=>config.association.min_projection_iou=v.parse().unwrap(),"loss"=>config.update.max_iou_loss=v.parse().unwrap(),
      "trace"=>{}, _=>panic!("{k}") } } }
    let truthp=args.iter().any(|a|a=="-truth"); let mut pm=dymlm_planes::PlaneMapper::new(dymlm_planes::PlaneConfig::default()).unwrap();
    let mut mapper=ObjectMapper::new(config).unwrap();
    let movers:Vec<String>=["person","dog"].map(String::from).to_vec();
    let mut why=std::collections::BTreeMap::new(); let mut times=vec![]; let mut steps=[0.0;4]; let mut counts=[0usize;8]; let mut ndet=0;
    for i in 0..frames {
      let t=r.f(); let pose=r.pose(); let nd=r.n(); let mut dets=vec![];
      for _ in 0..nd{let l=r.s();let s=r.f();let b=[r.f() as f32,r.f() as f32,r.f() as f32,r.f() as f32];dets.push(Detection::new(l,s as f32,BoundingBox::try_from(b).unwrap()).unwrap())}
      let px=&bytes[r.p..r.p+640*480*2]; r.p+=640*480*2;
      let q=|k:usize|u16::from_le_bytes([px[2*k],px[2*k+1]]);
      let depth=DepthImage::new(640,480,(0..640*480).map(|k|(q(k)&!1) as f32/10000.0).collect()).unwrap();
      let mask=Mask::new(640,480,(0..640*480).map(|k|q(k)&1==1).collect()).unwrap();
      let frame=Frame::new(t,cam,depth,None).unwrap();
      let view=ObjectView::new(&frame,&dets,&pose).with_static_mask(&mask).unwrap().without_labels(&movers);
      if !truthp { pm.insert(&frame,Some(&mask),&[],&pose).unwrap(); }
      let map_planes=|p:[f64;3],reach:f64,out:&mut Vec<SupportPlane>|{ for f in pm.map().planes() { let d=f.plane().signed_distance(p); if d.abs()<=reach { let n=f.plane().normal(); if f.holds([0,1,2].map(|k|p[k]-d*n[k])) {out.push(SupportPlane::new(f.id(),f.plane()))} } } };
      let planes: &dyn SupportingPlanes = if truthp {&truth_planes} else {&map_planes};
      let c0=cpu(); let t0=Instant::now(); mapper.parameterize(&view,planes).unwrap(); let t1=Instant::now(); mapper.associate(&view); let t2=Instant::now(); mapper.update(&view); let t3=Instant::now(); mapper.optimize(&view); let t4=Instant::now();
      times.push((cpu()-c0)*1e3); for (s,d) in steps.iter_mut().zip([t1-t0,t2-t1,t3-t2,t4-t3]){*s+=d.as_secs_f64()*1e3/frames as f64}
      let rep=mapper.take_report(); for rj in &rep.rejected { *why.entry((dets[rj.detection].label().to_string(),format!("{:?}",rj.cause))).or_insert(0usize)+=1; } ndet+=mapper.observations().len();
      counts[0]+=rep.associated.len();counts[1]+=rep.created.len();counts[2]+=rep.rejected.len();counts[3]+=rep.merged.len();counts[4]+=rep.removed.len();counts[5]+=rep.kept_parameters.len();counts[6]+=rep.updated.len();
      if args.iter().any(|a|a=="-r") { println!("{i}: {rep:?}"); }
      if let Some(spy)=args.iter().find_map(|a|a.strip_prefix("-spy:")) { let c:Vec<f64>=spy.split(',').map(|x|x.parse().unwrap()).collect(); for ob in mapper.observations(){ if (0..3).all(|a|(ob.centroid[a]-c[a]).abs()<0.3) { let m=rep.associated.iter().find(|a|a.detection==ob.detection); println!("{i}: {} {:.2} box {:?} n{} at{:.2?} len{:.3?} {:?} sup{:?} -> {:?}",ob.label,ob.score,ob.bounding_box,ob.points.len(),ob.centroid,ob.fit.oriented_box.lengths(),ob.completeness.sides(),ob.support.map(|s|s.id),m.map(|m|m.object)); } } }
      if let Some(id)=trace { let o=truth.iter().find(|o|o.id==id).unwrap(); let w=o.oriented_box; for ob in mapper.observations(){ let inv=w.world_from_box().inverse(); let c=inv.transform_point(ob.centroid); if (0..3).all(|a|c[a].abs()<w.lengths()[a]*0.5+0.1){ let m=rep.associated.iter().find(|a|a.detection==ob.detection); println!("{i}: {} {:.2} n{} c{:.3?} len{:.3?} ctr{:.3?} {:?} sup{:?} {:?} -> {:?}",ob.label,ob.score,ob.points.len(),c,ob.fit.oriented_box.lengths(),inv.transform_point(ob.fit.oriented_box.center()),ob.completeness.sides(),ob.support.map(|s|s.id),ob.fit.axes,m.map(|m|(m.object,m.tests))); } } }
    }
    let objs:Vec<&MapObject>=mapper.map().objects().collect();
    let est:Vec<EstimatedObject>=objs.iter().map(|o|EstimatedObject{label:o.label().into(),world_from_object:o.oriented_box().world_from_box(),dimensions:o.oriented_box().lengths()}).collect();
    let sc=score_objects(&est,&truth,&ObjectScoreConfig::default()).unwrap();
    times.sort_by(f64::total_cmp);
    println!("{name:20} {:>6.1}% {:>5.1}% {:>4} {:>6.3} {:>5.1}cm {:>5.1}%  {:.1} {:.1} {:.1}  steps {:.2?} obs {:.1}/frame assoc {} created {} rejected {} merged {} removed {} kept {} updated {}",100.*sc.recall().unwrap_or(f64::NAN),100.*sc.precision().unwrap_or(f64::NAN),sc.duplicates.len(),sc.mean_iou.unwrap_or(f64::NAN),100.*sc.center_error.map_or(f64::NAN,|e|e.median),100.*sc.label_accuracy().unwrap_or(f64::NAN),times[times.len()/2],times[times.len()*95/100],times[times.len()-1],steps,ndet as f64/frames as f64,counts[0],counts[1],counts[2],counts[3],counts[4],counts[5],counts[6]);
    if verbose { println!("   rejected: {why:?}");
      for (k,(o,sh)) in truth.iter().zip(&shares).enumerate() { if o.frames_visible<8 {continue}
        match sc.matches.iter().find(|m|m.object==o.id) { Some(m)=>{ let e=objs[m.estimate]; let inv=o.oriented_box.world_from_box().inverse(); let rel=OrientedBox::new(inv*e.oriented_box().world_from_box(),e.oriented_box().lengths()).unwrap(); let mut lo=[9.;3];let mut hi=[-9.;3];for c in rel.corners(){for a in 0..3{lo[a]=f64::min(lo[a],c[a]);hi[a]=f64::max(hi[a],c[a])}} println!("   {:2} {:12} v{:3} s{:.2} iou {:.2} ctr {:4.1}cm yaw {:5.1?} est {:2} {:10} obs {:3}/{:3} pts {} len {:.3?} true {:.3?} ctr {:.3?} sup {:?} {:?}",o.id,o.label,o.frames_visible,sh,m.iou,m.center_error*100.,m.yaw_error_degrees,e.id(),e.label(),e.observations(),e.frames_in_view(),e.point_count(),e.oriented_box().lengths(),o.oriented_box.lengths(),inv.transform_point(e.oriented_box().center()),e.support().map(|s|s.id),e.axes()); }
         None=>{println!("   {:2} {:12} v{:3} s{:.2} MISSED {:.3?}",o.id,o.label,o.frames_visible,sh,o.oriented_box.lengths()); for e in mapper.map().all_objects(){ let d=e.oriented_box().center(); let c=o.oriented_box.center(); let dd=((d[0]-c[0]).powi(2)+(d[1]-c[1]).powi(2)+(d[2]-c[2]).powi(2)).sqrt(); if dd<0.5*(o.oriented_box.lengths()[0]+0.2) {println!("        near: {} {} {:?} obs {} view {} len {:.3?} iou {:.2} d {:.3}",e.id(),e.label(),e.state(),e.observations(),e.frames_in_view(),e.oriented_box().lengths(),e.oriented_box().iou(&o.oriented_box),dd)}}} } }
      for &u in &sc.unmatched { let e=objs[u]; println!("   UNMATCHED {} {} obs {}/{} len {:.3?} at {:.2?} dup {} sup {:?} {:?} refusals",e.id(),e.label(),e.observations(),e.frames_in_view(),e.oriented_box().lengths(),e.oriented_box().center(),sc.duplicates.iter().any(|d|d.estimate==u),e.support().map(|s|s.id),e.axes()); let mut b:Vec<_>=truth.iter().map(|o|(o.oriented_box.iou(&e.oriented_box()),o.id)).collect(); b.sort_by(|a,b|b.0.total_cmp(&a.0)); println!("        best iou {:?}",&b[..2]); }
    }
  }
}
fn cpu()->f64{ let t=rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime); t.tv_sec as f64+t.tv_nsec as f64*1e-9 }
