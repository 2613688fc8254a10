use std::io::{self, Write};

use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Stride, Target, View};
use gltf_json::validation::{Checked, USize64};
use gltf_json::{Accessor, Asset, Buffer, Index, Root};

const MAGIC: &[u8; 4] = b"glTF";
const VERSION: u32 = 2;
const JSON_CHUNK: &[u8; 4] = b"JSON";
const BINARY_CHUNK: &[u8; 4] = b"BIN\0";

/// A glTF file that is being built: its JSON, and the bytes of its one buffer.
pub(super) struct Document {
    pub(super) root: Root,
    bytes: Vec<u8>,
}

impl Document {
    pub(super) fn new() -> Self {
        let generator = Some(concat!("dymlm-io ", env!("CARGO_PKG_VERSION")).to_owned());
        let root = Root { asset: Asset { generator, ..Asset::default() }, ..Root::default() };
        Self { root, bytes: Vec::new() }
    }

    /// Adds positions of vertices.
    pub(super) fn positions(&mut self, positions: &[[f32; 3]]) -> Index<Accessor> {
        let bytes: Vec<u8> = positions.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
        let view = self.view(&bytes, Target::ArrayBuffer, None);
        let mut accessor = accessor(view, 0, positions.len(), ComponentType::F32, Type::Vec3);
        bound(&mut accessor, positions);
        self.root.push(accessor)
    }

    /// Adds interleaved positions and linear colours of vertices. 16 bits of linear colour distinguish as
    /// many dark tones as 8-bit sRGB does; 8 bits do not.
    pub(super) fn colored_positions(
        &mut self,
        positions: &[[f32; 3]],
        colors: &[[f32; 3]],
    ) -> [Index<Accessor>; 2] {
        /// Three floats, three 16-bit numbers, and two bytes of padding to a multiple of 4.
        const STRIDE: usize = 20;
        let mut bytes = Vec::with_capacity(STRIDE * positions.len());
        for (position, color) in positions.iter().zip(colors) {
            bytes.extend(position.iter().flat_map(|c| c.to_le_bytes()));
            let sixteen_bits = color.map(|c| (c * f32::from(u16::MAX)).round() as u16);
            bytes.extend(sixteen_bits.iter().flat_map(|c| c.to_le_bytes()));
            bytes.extend_from_slice(&[0; 2]);
        }
        let view = self.view(&bytes, Target::ArrayBuffer, Some(STRIDE));
        let mut places = accessor(view, 0, positions.len(), ComponentType::F32, Type::Vec3);
        bound(&mut places, positions);
        let mut shades = accessor(view, 12, positions.len(), ComponentType::U16, Type::Vec3);
        shades.normalized = true;
        [self.root.push(places), self.root.push(shades)]
    }

    /// Adds the vertex indices of lines or triangles.
    pub(super) fn indices(&mut self, indices: &[u32]) -> Index<Accessor> {
        let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        let view = self.view(&bytes, Target::ElementArrayBuffer, None);
        self.root.push(accessor(view, 0, indices.len(), ComponentType::U32, Type::Scalar))
    }

    /// Adds bytes to the buffer. Every call adds a multiple of 4 bytes, so each view is aligned to 4.
    fn view(&mut self, bytes: &[u8], target: Target, stride: Option<usize>) -> Index<View> {
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.root.push(View {
            buffer: Index::new(0),
            byte_length: USize64::from(bytes.len()),
            byte_offset: Some(USize64::from(offset)),
            byte_stride: stride.map(Stride),
            name: None,
            target: Some(Checked::Valid(target)),
            extensions: None,
            extras: None,
        })
    }

    /// Writes everything as one binary file, `.glb`.
    pub(super) fn encode(mut self, out: &mut dyn Write) -> io::Result<()> {
        if !self.bytes.is_empty() {
            self.root.push(Buffer {
                byte_length: USize64::from(self.bytes.len()),
                name: None,
                uri: None,
                extensions: None,
                extras: None,
            });
        }
        let mut json = self.root.to_vec()?;
        json.resize(json.len().next_multiple_of(4), b' ');
        let has_bytes = !self.bytes.is_empty();
        let length = 12 + 8 + json.len() + if has_bytes { 8 + self.bytes.len() } else { 0 };
        let too_large =
            |_| io::Error::other(format!("a .glb of {length} bytes; it cannot have more than 4 GB"));
        let length = u32::try_from(length).map_err(too_large)?;
        out.write_all(MAGIC)?;
        out.write_all(&VERSION.to_le_bytes())?;
        out.write_all(&length.to_le_bytes())?;
        chunk(out, *JSON_CHUNK, &json)?;
        if has_bytes { chunk(out, *BINARY_CHUNK, &self.bytes) } else { Ok(()) }
    }
}

/// Writes a chunk; `bytes` are a multiple of 4, and less than 4 GB.
fn chunk(out: &mut dyn Write, kind: [u8; 4], bytes: &[u8]) -> io::Result<()> {
    out.write_all(&(bytes.len() as u32).to_le_bytes())?;
    out.write_all(&kind)?;
    out.write_all(bytes)
}

fn accessor(view: Index<View>, offset: usize, count: usize, of: ComponentType, type_: Type) -> Accessor {
    Accessor {
        buffer_view: Some(view),
        byte_offset: Some(USize64::from(offset)),
        count: USize64::from(count),
        component_type: Checked::Valid(GenericComponentType(of)),
        type_: Checked::Valid(type_),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
        extensions: None,
        extras: None,
    }
}

/// Sets the bounds that glTF requires of positions.
fn bound(accessor: &mut Accessor, positions: &[[f32; 3]]) {
    let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    let [min, max] = &mut bounds;
    for position in positions {
        for ((low, high), c) in min.iter_mut().zip(max.iter_mut()).zip(position) {
            (*low, *high) = (low.min(*c), high.max(*c));
        }
    }
    let [min, max] = bounds.map(|bound| bound.to_vec().into());
    (accessor.min, accessor.max) = (Some(min), Some(max));
}
