use parry3d::math::Vec3;

/// How a surface looks to the colour camera and to the depth camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Material {
    /// The two colours that the pattern mixes, 0..=1 a channel.
    pub(crate) colors: [[f32; 3]; 2],
    pub(crate) pattern: Pattern,
    /// Size of the pattern's features, metres.
    pub(crate) scale: f32,
    /// Share of depth readings that are lost on the surface: near 1 for black glass.
    pub(crate) absorption: f32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pattern {
    /// Blotches and grain: plaster, fabric, skin.
    Noise,
    /// Squares: tiles, a chequered shirt.
    Checker,
    /// Bands along the first surface axis: books on a shelf, knitwear.
    Stripes,
    /// Noise drawn out along the first surface axis.
    Wood,
    /// Rows of small marks: text on a screen, keys.
    Glyphs,
}

impl Material {
    pub(crate) const fn new(pattern: Pattern, scale: f32, first: [f32; 3], second: [f32; 3]) -> Self {
        Self { colors: [first, second], pattern, scale, absorption: 0.0 }
    }

    /// The same surface with a share of the depth readings lost.
    pub(crate) const fn absorbing(mut self, absorption: f32) -> Self {
        self.absorption = absorption;
        self
    }

    /// Puts into `mix` the share of the second colour, 0..=1, at points of the surface given by their
    /// [`surface_coordinates`] `s` and `t` in metres. With another `seed`, equal things look different. The
    /// lists have the same length.
    pub(crate) fn mix(&self, s: &[f32], t: &[f32], seed: u32, mix: &mut [f32]) {
        // Each pattern has a loop without branches, which compiles to vector code.
        match self.pattern {
            Pattern::Noise => self.mix_by(s, t, mix, |s, t| {
                0.85 * noise(s, t, seed) + 0.15 * hash(floor(24.0 * s), floor(24.0 * t), seed ^ 1)
            }),
            Pattern::Checker => self.mix_by(s, t, mix, |s, t| {
                let odd = (floor(s) ^ floor(t)) & 1;
                0.85 * odd as f32 + 0.15 * noise(5.0 * s, 5.0 * t, seed)
            }),
            Pattern::Stripes => {
                self.mix_by(s, t, mix, |s, t| 0.8 * hash(floor(s), 0, seed) + 0.2 * noise(s, 0.3 * t, seed));
            }
            Pattern::Wood => self.mix_by(s, t, mix, |s, t| {
                0.8 * noise(0.12 * s, t, seed) + 0.2 * noise(0.5 * s, 6.0 * t, seed ^ 1)
            }),
            Pattern::Glyphs => self.mix_by(s, t, mix, |s, t| {
                let (row, column) = (floor(t), floor(s));
                let in_line = t - (row as f32) < 0.6 && s - (column as f32) < 0.75;
                let mark = hash(column, row, seed);
                if in_line { mark } else { 0.0 }
            }),
        }
    }

    #[inline(always)]
    #[allow(clippy::inline_always, reason = "a call a pixel would keep the loop scalar")]
    fn mix_by(&self, s: &[f32], t: &[f32], mix: &mut [f32], pattern: impl Fn(f32, f32) -> f32) {
        for ((mix, &s), &t) in mix.iter_mut().zip(s).zip(t) {
            *mix = pattern(s / self.scale, t / self.scale);
        }
    }

    /// The colour at a mix of the two, 0..=1 a channel.
    #[inline]
    pub(crate) fn color(&self, mix: f32) -> [f32; 3] {
        let [first, second] = self.colors;
        std::array::from_fn(|channel| first[channel] + mix * (second[channel] - first[channel]))
    }
}

/// Two coordinates along the surface: all but the one of the axis that the normal is closest to.
#[inline]
pub(crate) fn surface_coordinates(p: Vec3, normal: Vec3) -> [f32; 2] {
    let n = normal.abs();
    if n.x >= n.y && n.x >= n.z {
        [p.y, p.z]
    } else if n.y >= n.z {
        [p.x, p.z]
    } else {
        [p.x, p.y]
    }
}

/// Smooth value noise, 0..=1, with features of size 1 (Perlin's lattice with values instead of gradients).
#[inline]
fn noise(s: f32, t: f32, seed: u32) -> f32 {
    let (i, j) = (floor(s), floor(t));
    let (fs, ft) = (s - i as f32, t - j as f32);
    let (ws, wt) = (fs * fs * (3.0 - 2.0 * fs), ft * ft * (3.0 - 2.0 * ft));
    let lower = hash(i, j, seed) * (1.0 - ws) + hash(i.wrapping_add(1), j, seed) * ws;
    let upper =
        hash(i, j.wrapping_add(1), seed) * (1.0 - ws) + hash(i.wrapping_add(1), j.wrapping_add(1), seed) * ws;
    lower * (1.0 - wt) + upper * wt
}

/// The largest whole number not above `x`; inlined, while `f32::floor` is a call on plain x86-64.
#[inline]
fn floor(x: f32) -> i32 {
    let towards_zero = x as i32;
    towards_zero - i32::from(x < towards_zero as f32)
}

/// A value of 0..1 for a lattice point.
#[inline]
fn hash(i: i32, j: i32, seed: u32) -> f32 {
    let mut h = (i as u32).wrapping_mul(0x9e37_79b1)
        ^ (j as u32).wrapping_mul(0x85eb_ca77)
        ^ seed.wrapping_mul(0xc2b2_ae3d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x2c1b_3c6d);
    h ^= h >> 13;
    (h >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pattern_varies_and_stays_between_its_colours() {
        for pattern in [Pattern::Noise, Pattern::Checker, Pattern::Stripes, Pattern::Wood, Pattern::Glyphs] {
            let material = Material::new(pattern, 0.05, [0.2, 0.3, 0.4], [0.8, 0.3, 0.1]);
            let (s, t): (Vec<f32>, Vec<f32>) =
                (0..400_u16).map(|i| (-0.5 + 0.013 * f32::from(i % 20), 0.017 * f32::from(i / 20))).unzip();
            let mut mix = vec![0.0; 400];
            material.mix(&s, &t, 3, &mut mix);
            let colors = mix.iter().map(|&mix| material.color(mix));
            let reds: Vec<f32> = colors
                .map(|[r, g, b]| {
                    assert!((0.2..=0.8).contains(&r) && (g - 0.3).abs() < 1e-6 && (0.1..=0.4).contains(&b));
                    r
                })
                .collect();
            let (low, high) = reds.iter().fold((1.0_f32, 0.0_f32), |(l, h), &r| (l.min(r), h.max(r)));
            assert!(high - low > 0.2, "{pattern:?} spans {low} to {high}");
        }
    }
}
