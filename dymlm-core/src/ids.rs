use std::fmt;

use crate::paging::Record;

/// An id is a number with a kind.
pub trait Numbered: Copy + Ord {
    /// The id with this number.
    fn numbered(number: u64) -> Self;

    /// The id's number.
    fn number(self) -> u64;
}

macro_rules! id {
    ($(#[$documentation:meta])* $name:ident) => {
        $(#[$documentation])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
        pub struct $name(u64);

        impl $name {
            /// The id with this number.
            #[inline]
            #[must_use]
            pub const fn new(number: u64) -> Self {
                Self(number)
            }

            /// The id's number: unique within its map, never used again.
            #[inline]
            #[must_use]
            pub const fn get(self) -> u64 {
                self.0
            }
        }

        impl Record for $name {
            fn write(&self, out: &mut Vec<u8>) {
                self.0.write(out);
            }

            fn read(from: &mut &[u8]) -> Option<Self> {
                u64::read(from).map(Self)
            }
        }

        impl Numbered for $name {
            fn numbered(number: u64) -> Self {
                Self(number)
            }

            fn number(self) -> u64 {
                self.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(formatter)
            }
        }
    };
}

id! {
    /// A plane of a plane map. After a merge the id of the absorbed plane still leads to the plane that it
    /// became part of.
    PlaneId
}
id! {
    /// An object of an object map. After a merge the id of the absorbed object still leads to the object that
    /// it became part of.
    ObjectId
}
id! {
    /// A frame that a map builder has taken in. Ids ascend in the order of insertion.
    FrameId
}
id! {
    /// A tracked mover. Ids ascend in the order in which tracks begin.
    TrackId
}
id! {
    /// The number, counted from 0 for each kind, with which a plane or an object came into its map. A map
    /// that is built again from the same input gives the same births, whatever ids its things have; see
    /// [`Names`](crate::Names).
    Birth
}
