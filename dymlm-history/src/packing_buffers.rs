use miniz_oxide::deflate::core::{
    CompressorOxide, TDEFLFlush, compress_to_output, create_comp_flags_from_zip_params,
};

use crate::number_plane::PlaneBuffers;

/// Deflate's level for everything but the images: mostly masks, which any level makes tiny.
const LEVEL: i32 = 4;

/// Buffers of packing, kept from observation to observation: else each of them would ask the system for some
/// megabytes, which it clears page by page while frames are mapped.
#[derive(Default)]
pub(crate) struct PackingBuffers {
    pub(crate) plane: PlaneBuffers,
    /// What is deflated.
    pub(crate) beside: Vec<u8>,
    pub(crate) images: Vec<u8>,
    pub(crate) deflated: Vec<u8>,
    compressor: Option<Box<CompressorOxide>>,
}

impl PackingBuffers {
    /// Deflates what is `beside` the images.
    pub(crate) fn deflate(&mut self) {
        let Self { beside, deflated, compressor, .. } = self;
        deflated.clear();
        let compressor = compressor.get_or_insert_with(|| {
            Box::new(CompressorOxide::new(create_comp_flags_from_zip_params(LEVEL, 0, 0)))
        });
        compressor.reset();
        // It takes all bytes, since it may always give some.
        compress_to_output(compressor, beside, TDEFLFlush::Finish, |bytes| {
            deflated.extend_from_slice(bytes);
            true
        });
    }
}
