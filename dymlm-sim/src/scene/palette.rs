//! The materials of things.

use super::Material;
use super::material::Pattern::{Checker, Glyphs, Noise, Stripes, Wood};
use super::person::Clothes;

pub(super) const PLASTER: Material = Material::new(Noise, 0.35, [0.78, 0.77, 0.72], [0.88, 0.87, 0.83]);
pub(super) const CARPET: Material = Material::new(Checker, 0.5, [0.33, 0.36, 0.40], [0.42, 0.44, 0.47]);
pub(super) const FABRIC: Material = Material::new(Noise, 0.06, [0.38, 0.45, 0.55], [0.50, 0.58, 0.68]);
pub(super) const BEECH: Material = Material::new(Wood, 0.05, [0.66, 0.50, 0.33], [0.80, 0.66, 0.47]);
pub(super) const STEEL: Material = Material::new(Noise, 0.2, [0.55, 0.56, 0.58], [0.66, 0.67, 0.69]);
pub(super) const BLACK: Material = Material::new(Noise, 0.04, [0.07, 0.07, 0.08], [0.15, 0.15, 0.16]);
pub(super) const SCREEN: Material =
    Material::new(Glyphs, 0.02, [0.10, 0.12, 0.20], [0.75, 0.85, 0.95]).absorbing(0.35);
pub(super) const KEYS: Material = Material::new(Glyphs, 0.019, [0.06, 0.06, 0.07], [0.45, 0.45, 0.47]);
pub(super) const CUSHION: Material = Material::new(Noise, 0.03, [0.12, 0.16, 0.30], [0.24, 0.30, 0.48]);
pub(super) const CABINET: Material = Material::new(Noise, 0.3, [0.62, 0.63, 0.60], [0.72, 0.73, 0.70]);
pub(super) const PAPER: Material = Material::new(Glyphs, 0.012, [0.93, 0.92, 0.88], [0.25, 0.25, 0.28]);
pub(super) const SPINES: Material = Material::new(Stripes, 0.035, [0.55, 0.14, 0.12], [0.16, 0.35, 0.55]);
pub(super) const PLUSH: Material = Material::new(Noise, 0.02, [0.45, 0.29, 0.15], [0.64, 0.45, 0.27]);
pub(super) const LEAVES: Material = Material::new(Noise, 0.04, [0.10, 0.28, 0.10], [0.30, 0.52, 0.20]);
pub(super) const CLAY: Material = Material::new(Noise, 0.1, [0.60, 0.33, 0.22], [0.70, 0.42, 0.30]);
pub(super) const GLASS: Material =
    Material::new(Stripes, 0.07, [0.12, 0.40, 0.22], [0.85, 0.88, 0.80]).absorbing(0.15);
/// Windows and polished black surfaces: no readings at all.
pub(super) const PANE: Material =
    Material::new(Noise, 0.5, [0.05, 0.06, 0.08], [0.12, 0.13, 0.15]).absorbing(1.0);
pub(super) const CHINA: Material = Material::new(Stripes, 0.03, [0.90, 0.90, 0.88], [0.75, 0.20, 0.18]);
pub(super) const WALNUT: Material = Material::new(Wood, 0.06, [0.28, 0.17, 0.10], [0.45, 0.30, 0.19]);
pub(super) const OAK: Material = Material::new(Wood, 0.09, [0.55, 0.42, 0.28], [0.70, 0.57, 0.40]);
pub(super) const WHITE: Material = Material::new(Noise, 0.12, [0.80, 0.80, 0.80], [0.93, 0.93, 0.92]);
pub(super) const PLANKS: Material = Material::new(Wood, 0.12, [0.42, 0.29, 0.18], [0.60, 0.44, 0.29]);
pub(super) const TILES: Material = Material::new(Checker, 0.4, [0.62, 0.60, 0.56], [0.74, 0.72, 0.68]);
pub(super) const OCHRE: Material = Material::new(Noise, 0.4, [0.72, 0.60, 0.42], [0.82, 0.71, 0.53]);
pub(super) const MINT: Material = Material::new(Noise, 0.3, [0.62, 0.72, 0.66], [0.73, 0.82, 0.77]);
pub(super) const CONCRETE: Material = Material::new(Noise, 0.15, [0.50, 0.50, 0.49], [0.64, 0.63, 0.62]);
pub(super) const CARDBOARD: Material = Material::new(Noise, 0.05, [0.60, 0.46, 0.30], [0.72, 0.58, 0.41]);
pub(super) const TWEED: Material = Material::new(Checker, 0.02, [0.40, 0.22, 0.20], [0.56, 0.36, 0.30]);
pub(super) const TERRACOTTA: Material = Material::new(Stripes, 0.05, [0.66, 0.34, 0.22], [0.85, 0.72, 0.52]);
pub(super) const ALUMINIUM: Material =
    Material::new(Noise, 0.08, [0.66, 0.67, 0.69], [0.76, 0.77, 0.79]).absorbing(0.1);
pub(super) const LEATHER: Material = Material::new(Checker, 0.07, [0.88, 0.87, 0.84], [0.12, 0.12, 0.13]);
pub(super) const PEEL: Material = Material::new(Noise, 0.01, [0.90, 0.48, 0.08], [0.98, 0.62, 0.16]);
const SKIN: Material = Material::new(Noise, 0.08, [0.78, 0.58, 0.47], [0.86, 0.67, 0.56]);

/// Heights in metres and clothes of the usual two people.
pub(super) const PEOPLE: [(f32, Clothes); 2] = [
    (
        1.76,
        Clothes {
            shirt: Material::new(Checker, 0.06, [0.55, 0.10, 0.12], [0.75, 0.65, 0.60]),
            trousers: Material::new(Noise, 0.05, [0.12, 0.17, 0.32], [0.22, 0.28, 0.46]),
            skin: SKIN,
            hair: Material::new(Noise, 0.02, [0.15, 0.10, 0.06], [0.28, 0.19, 0.11]),
            shoes: BLACK,
        },
    ),
    (
        1.68,
        Clothes {
            shirt: Material::new(Stripes, 0.05, [0.15, 0.35, 0.25], [0.55, 0.70, 0.45]),
            trousers: Material::new(Noise, 0.05, [0.28, 0.26, 0.23], [0.42, 0.40, 0.36]),
            skin: SKIN,
            hair: Material::new(Noise, 0.02, [0.45, 0.35, 0.20], [0.62, 0.50, 0.30]),
            shoes: Material::new(Noise, 0.05, [0.45, 0.42, 0.40], [0.60, 0.58, 0.55]),
        },
    ),
];
