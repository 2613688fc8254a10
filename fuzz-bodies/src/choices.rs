use dymlm_core::Pose;

/// Reads choices from bytes; after the end of the bytes, all choices are zero.
#[derive(Debug, Clone)]
pub(crate) struct Choices<'a> {
    rest: &'a [u8],
}

impl<'a> Choices<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    pub(crate) fn is_over(&self) -> bool {
        self.rest.is_empty()
    }

    pub(crate) fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.rest.split_first() else { return 0 };
        self.rest = rest;
        first
    }

    /// A number from 0 to `end`, exclusive.
    pub(crate) fn below(&mut self, end: u8) -> u8 {
        self.byte() % end.max(1)
    }

    /// A number from 0 to `end`, exclusive, for large `end`.
    pub(crate) fn number_below(&mut self, end: usize) -> usize {
        let number = usize::from(self.byte()) << 8 | usize::from(self.byte());
        number % end.max(1)
    }

    pub(crate) fn is_true(&mut self) -> bool {
        self.byte() % 2 == 1
    }

    /// A number, mostly of the order of 1, seldom extreme or NaN.
    pub(crate) fn number(&mut self) -> f64 {
        let (kind, value) = (self.byte(), self.byte());
        let signed = f64::from(value.cast_signed());
        match kind {
            0..=199 => signed / 32.0 + f64::from(kind) / 6400.0,
            200..=229 => signed * 8.0,
            230..=243 => signed * 10.0_f64.powi(i32::from(kind) - 230),
            244..=249 => signed * 10.0_f64.powi((i32::from(kind) - 250) * 8),
            250 => f64::MAX.copysign(signed),
            251 => f64::MIN_POSITIVE.copysign(signed),
            252 => f64::INFINITY.copysign(signed),
            253 => f64::NAN,
            254 => f64::from(f32::MAX).copysign(signed),
            255 => signed * f64::from(f32::MIN_POSITIVE) / 1024.0,
        }
    }

    pub(crate) fn numbers<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.number())
    }

    /// A pose near those of cameras, seldom anywhere.
    pub(crate) fn pose(&mut self) -> Pose {
        if self.byte() < 200 {
            let [x, y, z] = [0; 3].map(|_| f64::from(self.byte().cast_signed()) / 256.0);
            let angle = f64::from(self.byte().cast_signed()) / 256.0;
            return Pose::new([x, y, z], [0.0, angle.sin(), 0.0, angle.cos()]).unwrap_or_default();
        }
        Pose::new(self.numbers(), self.numbers()).unwrap_or_default()
    }
}
