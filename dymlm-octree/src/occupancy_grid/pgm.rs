use super::OccupancyGrid;
use crate::Error;

/// A gray image, row by row from the top.
#[derive(Debug, PartialEq)]
pub(super) struct GrayImage {
    pub(super) width: usize,
    pub(super) height: usize,
    /// The value of white.
    pub(super) most: u16,
    pub(super) pixels: Vec<u16>,
}

impl GrayImage {
    /// Reads a PGM file, binary (P5) or as text (P2).
    pub(super) fn read(file: &[u8]) -> Result<Self, Error> {
        let mut rest = file;
        let kind = token(&mut rest);
        if kind != b"P5" && kind != b"P2" {
            return malformed("the image is no PGM file: it begins neither with P5 nor with P2");
        }
        let (Some(width), Some(height), Some(most)) =
            (number(&mut rest), number(&mut rest), number(&mut rest))
        else {
            return malformed("the image's header ends before width, height and greatest value");
        };
        let Some(most) = u16::try_from(most).ok().filter(|&most| most > 0) else {
            return malformed(&format!("the image's greatest value is {most}, not 1 to 65535"));
        };
        let (width, height) = (u64::from(width), u64::from(height));
        let count = width.checked_mul(height).filter(|&count| count <= OccupancyGrid::MAX_CELLS);
        let count = count.ok_or(Error::GridSize { width, height })? as usize;
        let pixels: Vec<u16> = if kind == b"P2" {
            (0..count).map_while(|_| u16::try_from(number(&mut rest)?).ok()).collect()
        } else {
            // One white space follows the header.
            let pixels = rest.get(1..).unwrap_or_default();
            if most < 256 {
                pixels.iter().take(count).map(|&value| u16::from(value)).collect()
            } else {
                let pairs = pixels.chunks_exact(2).take(count);
                pairs.map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect()
            }
        };
        if pixels.len() < count {
            return malformed(&format!(
                "the image ends after {} of its {width}x{height} pixels",
                pixels.len()
            ));
        }
        if let Some(value) = pixels.iter().find(|value| **value > most) {
            return malformed(&format!("a pixel of the image is {value}, greater than {most}"));
        }
        Ok(Self { width: width as usize, height: height as usize, most, pixels })
    }
}

fn malformed<T>(what: &str) -> Result<T, Error> {
    Err(Error::MapFile(what.to_owned()))
}

/// The next word; comments from # to the end of the line are skipped.
fn token<'a>(rest: &mut &'a [u8]) -> &'a [u8] {
    loop {
        *rest = rest.trim_ascii_start();
        if rest.first() != Some(&b'#') {
            break;
        }
        let end = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
        *rest = &rest[end..];
    }
    let end = rest.iter().position(|byte| byte.is_ascii_whitespace() || *byte == b'#').unwrap_or(rest.len());
    let (token, left) = rest.split_at(end);
    *rest = left;
    token
}

fn number(rest: &mut &[u8]) -> Option<u32> {
    std::str::from_utf8(token(rest)).ok()?.parse().ok()
}
