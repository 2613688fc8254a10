//! How things are written to the page file: number by number, in their own widths. Only the process that
//! writes the file reads it, so it needs no version.

use std::sync::Arc;

/// What can be written to a [page file](super::PageFile) and read back to the bit.
pub trait Record: Sized {
    /// Appends it to the bytes.
    fn write(&self, out: &mut Vec<u8>);

    /// Reads one from the beginning of the bytes; `None` where they do not begin with one.
    fn read(from: &mut &[u8]) -> Option<Self>;

    /// Appends several, one after the other.
    fn write_all(items: &[Self], out: &mut Vec<u8>) {
        for item in items {
            item.write(out);
        }
    }

    /// Reads so many, one after the other.
    fn read_all(count: usize, from: &mut &[u8]) -> Option<Vec<Self>> {
        // One takes a byte at least.
        let mut items = Vec::with_capacity(count.min(from.len()));
        for _ in 0..count {
            items.push(Self::read(from)?);
        }
        Some(items)
    }

    /// Reads some over others.
    fn read_into(items: &mut [Self], from: &mut &[u8]) -> Option<()> {
        for item in items {
            *item = Self::read(from)?;
        }
        Some(())
    }
}

// Numbers are most of what is written: many of them are one copy.
macro_rules! number {
    ($($type:ty),*) => {$(
        impl Record for $type {
            fn write(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }

            fn read(from: &mut &[u8]) -> Option<Self> {
                let (bytes, rest) = from.split_first_chunk()?;
                *from = rest;
                Some(Self::from_le_bytes(*bytes))
            }

            fn write_all(items: &[Self], out: &mut Vec<u8>) {
                let begin = out.len();
                out.resize(begin + size_of_val(items), 0);
                let (places, _) = out[begin..].as_chunks_mut();
                places.iter_mut().zip(items).for_each(|(place, item)| *place = item.to_le_bytes());
            }

            fn read_all(count: usize, from: &mut &[u8]) -> Option<Vec<Self>> {
                let (bytes, rest) = from.split_at_checked(count.checked_mul(size_of::<Self>())?)?;
                *from = rest;
                let (bytes, _) = bytes.as_chunks();
                Some(bytes.iter().map(|bytes| Self::from_le_bytes(*bytes)).collect())
            }

            fn read_into(items: &mut [Self], from: &mut &[u8]) -> Option<()> {
                let (bytes, rest) = from.split_at_checked(size_of_val(items))?;
                *from = rest;
                let (bytes, _) = bytes.as_chunks();
                items.iter_mut().zip(bytes).for_each(|(item, bytes)| *item = Self::from_le_bytes(*bytes));
                Some(())
            }
        }
    )*};
}
number!(u8, u16, u32, u64, i8, i32, f32, f64);

impl Record for bool {
    fn write(&self, out: &mut Vec<u8>) {
        u8::from(*self).write(out);
    }

    fn read(from: &mut &[u8]) -> Option<Self> {
        Some(u8::read(from)? != 0)
    }
}

impl<T: Record + Copy, const N: usize> Record for [T; N] {
    fn write(&self, out: &mut Vec<u8>) {
        T::write_all(self, out);
    }

    fn read(from: &mut &[u8]) -> Option<Self> {
        const { assert!(N > 0, "an array of no items has no first one, which the others are filled with") };
        let mut items = [T::read(from)?; N];
        T::read_into(&mut items[1..], from)?;
        Some(items)
    }

    fn write_all(items: &[Self], out: &mut Vec<u8>) {
        T::write_all(items.as_flattened(), out);
    }

    fn read_into(items: &mut [Self], from: &mut &[u8]) -> Option<()> {
        T::read_into(items.as_flattened_mut(), from)
    }
}

impl<T: Record> Record for Vec<T> {
    fn write(&self, out: &mut Vec<u8>) {
        (self.len() as u32).write(out);
        T::write_all(self, out);
    }

    fn read(from: &mut &[u8]) -> Option<Self> {
        let len = u32::read(from)? as usize;
        T::read_all(len, from)
    }
}

impl<T: Record> Record for Box<[T]> {
    fn write(&self, out: &mut Vec<u8>) {
        (self.len() as u32).write(out);
        T::write_all(self, out);
    }

    fn read(from: &mut &[u8]) -> Option<Self> {
        Vec::read(from).map(Vec::into_boxed_slice)
    }
}

macro_rules! pointer {
    ($($type:ident),*) => {$(
        impl<T: Record> Record for $type<T> {
            fn write(&self, out: &mut Vec<u8>) {
                (**self).write(out);
            }

            fn read(from: &mut &[u8]) -> Option<Self> {
                T::read(from).map(Self::new)
            }
        }
    )*};
}
pointer!(Box, Arc);

impl<A: Record, B: Record> Record for (A, B) {
    fn write(&self, out: &mut Vec<u8>) {
        self.0.write(out);
        self.1.write(out);
    }

    fn read(from: &mut &[u8]) -> Option<Self> {
        Some((A::read(from)?, B::read(from)?))
    }
}

impl<T: Record> Record for Option<T> {
    fn write(&self, out: &mut Vec<u8>) {
        self.is_some().write(out);
        if let Some(value) = self {
            value.write(out);
        }
    }

    fn read(from: &mut &[u8]) -> Option<Self> {
        if bool::read(from)? { T::read(from).map(Some) } else { Some(None) }
    }
}

/// Implements [`Record`](crate::paging::Record) for structs, field by field.
#[macro_export]
macro_rules! record {
    ($type:ty { $($field:ident),* $(,)? }) => {
        impl $crate::paging::Record for $type {
            fn write(&self, out: &mut Vec<u8>) {
                $($crate::paging::Record::write(&self.$field, out);)*
            }

            fn read(from: &mut &[u8]) -> Option<Self> {
                Some(Self { $($field: $crate::paging::Record::read(from)?),* })
            }
        }
    };
}

/// Implements [`Record`](crate::paging::Record) for enums of which each case holds one value or none, by the
/// number of the case.
#[macro_export]
macro_rules! record_of_cases {
    ($type:ty { $($number:literal => $case:ident $(($value:ident))?),* $(,)? }) => {
        impl $crate::paging::Record for $type {
            fn write(&self, out: &mut Vec<u8>) {
                match self {
                    $(Self::$case $(($value))? => {
                        out.push($number);
                        $($crate::paging::Record::write($value, out);)?
                    })*
                }
            }

            fn read(from: &mut &[u8]) -> Option<Self> {
                Some(match <u8 as $crate::paging::Record>::read(from)? {
                    $($number => Self::$case $(({
                        let $value = $crate::paging::Record::read(from)?;
                        $value
                    }))?,)*
                    _ => return None,
                })
            }
        }
    };
}
