//! The scalar types of point clouds' fields.

/// All scalar types: runs a macro on their names and types.
macro_rules! with_scalars {
    ($macro:ident) => {
        $macro! { I8 i8, U8 u8, I16 i16, U16 u16, I32 i32, U32 u32, I64 i64, U64 u64, F32 f32, F64 f64 }
    };
}
pub(crate) use with_scalars;

macro_rules! define_scalar {
    ($($name:ident $type:ty),*) => {
        /// Scalar type of a field.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(crate) enum Scalar {
            $($name),*
        }

        impl Scalar {
            /// Bytes.
            #[inline]
            pub(crate) fn size(self) -> usize {
                match self {
                    $(Self::$name => size_of::<$type>()),*
                }
            }

            /// The value whose little-endian bytes come first in `bytes`; 64-bit integers beyond 2^53 are
            /// rounded.
            #[inline]
            #[allow(clippy::cast_lossless, reason = "one line for all types")]
            pub(crate) fn to_f64(self, bytes: [u8; 8]) -> f64 {
                match self {
                    $(Self::$name => {
                        let own = bytes.first_chunk().copied().unwrap_or_default();
                        <$type>::from_le_bytes(own) as f64
                    }),*
                }
            }
        }
    };
}
with_scalars!(define_scalar);

impl Scalar {
    /// Whether values are whole numbers.
    pub(crate) fn is_whole(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}
