//! How things are written to the page file: number by number, in their own widths. Only the process that
//! writes the file reads it, so it needs no version.

use std::sync::Arc;

/// What can be written to a [page file](super::PageFile) and read back to the bit.
pub trait Record: Sized {
    /// Appends it to the bytes.
    fn write(&self, out: &mut Vec<u8>);

    /// Reads one from the beginning of the bytes; `None` where they do not begin with one.
    fn read(from: &mut &[u8]) -> Option<Self>;
}

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
        for item in self {
            item.write(out);
        }
    }

    fn read(from: &mut &[u8]) -> Option<Self> {
        const { assert!(N > 0, "an array of no items has no first one, which the others are filled with") };
        let mut items = [T::read(from)?; N];
        for item in items.iter_mut().skip(1) {
            *item = T::read(from)?;
        }
        Some(items)
    }
}

impl<T: Record> Record for Vec<T> {
    fn write(&self, out: &mut Vec<u8>) {
        (self.len() as u32).write(out);
        for item in self {
            item.write(out);
        }
    }

    fn read(from: &mut &[u8]) -> Option<Self> {
        let len = u32::read(from)? as usize;
        // An item takes a byte at least.
        let mut items = Self::with_capacity(len.min(from.len()));
        for _ in 0..len {
            items.push(T::read(from)?);
        }
        Some(items)
    }
}

impl<T: Record> Record for Box<[T]> {
    fn write(&self, out: &mut Vec<u8>) {
        (self.len() as u32).write(out);
        for item in self {
            item.write(out);
        }
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

/// Implements [`Record`](crate::paging::Record) for enums of which each case holds one value or none, by the number
/// of the case.
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
