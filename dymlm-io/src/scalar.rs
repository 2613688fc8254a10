//! The scalar types of the fields of point clouds.

/// Scalar type of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    /// Bytes.
    #[inline]
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The value in the first [`Self::size`] little-endian bytes; 64-bit integers beyond 2^53 are rounded.
    #[inline]
    pub(crate) fn to_f64(self, bytes: [u8; 8]) -> f64 {
        let unsigned = u64::from_le_bytes(bytes);
        // Shifting up and down again keeps the sign and drops the bytes after the value.
        let beyond = 64 - 8 * self.size();
        match self {
            Self::F32 => f32::from_bits(unsigned as u32).into(),
            Self::F64 => f64::from_bits(unsigned),
            Self::I8 | Self::I16 | Self::I32 | Self::I64 => {
                (unsigned << beyond).cast_signed().wrapping_shr(beyond as u32) as f64
            }
            Self::U8 | Self::U16 | Self::U32 | Self::U64 => (unsigned << beyond >> beyond) as f64,
        }
    }

    /// Whether values are whole numbers.
    pub(crate) fn is_whole(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}
