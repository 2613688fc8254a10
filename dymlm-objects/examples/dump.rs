#![allow(warnings, clippy::all)]
use std::io::Write;
use dymlm_dynamics::*; use dymlm_sim::*;
fn s(w:&mut Vec<u8>, t:&str){ w.extend((t.len() as u32).to_le_bytes()); w.extend(t.as_bytes()); }
fn f(w:&mut Vec<u8>, x:f64){ w.extend(x.to_le_bytes()); }
fn n(w:&mut Vec<u8>, x:usize){ w.extend((x as u32).to_le_bytes()); }
fn main(){
  let args:Vec<String>=std::env::args().collect();
  for kind in SequenceType::ALL {
    if args.len()>1 && !args[1..].iter().any(|a| a==kind.name()) {continue}
    let path=format!("/tmp/objcache/{}.bin",kind.name());
    let seq=Sequence::new(&kind.config()).unwrap();
    let mut truth=Truth::new(&seq,&TruthConfig::default()).unwrap();
    let mut pre=Preprocessor::new(DynamicsConfig::default()).unwrap();
    let mut scratch=FrameScratch::default();
    let mut w=Vec::new();
    for i in 0..seq.len(){
      let fr=seq.frame_with(i,&mut scratch).unwrap();
      truth.observe(&fr);
      pre.process(&fr.frame,&fr.detections,&fr.world_from_camera).unwrap();
      f(&mut w,fr.frame.timestamp());
      for c in fr.world_from_camera.translation(){f(&mut w,c)} for c in fr.world_from_camera.quaternion(){f(&mut w,c)}
      n(&mut w,fr.detections.len());
      for d in &fr.detections { s(&mut w,d.label()); f(&mut w,d.score() as f64); let b=<[f32;4]>::from(d.bounding_box()); for c in b {f(&mut w,c as f64)} }
      for (z,m) in fr.frame.depth().data().iter().zip(pre.static_mask().data()) { let q=((*z*10000.0).round() as u32).min(65534) as u16; let q = q & !1 | u16::from(*m); w.extend(q.to_le_bytes()); }
      scratch.recycle(fr);
    }
    let mut h=Vec::new();
    n(&mut h,seq.len());
    let objs=truth.objects(); n(&mut h,objs.len());
    for o in &objs { n(&mut h,o.id); s(&mut h,&o.label); let p=o.oriented_box.world_from_box(); for c in p.translation(){f(&mut h,c)} for c in p.quaternion(){f(&mut h,c)} for c in o.oriented_box.lengths(){f(&mut h,c)} n(&mut h,o.frames_visible as usize); f(&mut h,o.visible_share);}
    let faces=truth.faces(); n(&mut h,faces.len());
    for q in &faces { n(&mut h,q.id); s(&mut h,q.label.unwrap_or("")); for c in q.plane.normal(){f(&mut h,c)} f(&mut h,q.plane.d()); f(&mut h,q.visible_area); n(&mut h,q.outline.len()); for r in &q.outline { n(&mut h,r.len()); for p in r { for c in p {f(&mut h,*c)} } } }
    let mut file=std::fs::File::create(&path).unwrap(); file.write_all(&h).unwrap(); file.write_all(&w).unwrap();
    println!("{} done",kind.name());
  }
}
