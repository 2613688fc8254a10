/// Seconds between two sessions where the clock of the later one does not tell: longer than the time that the
/// evidence counts as one look.
const PAUSE: f64 = 10.0;

/// The clock of the maps goes on over all sessions, since what was seen later outweighs what was seen before.
/// The clock of a session may begin anew, at 0 or at the start of its recording: then the session is put
/// behind the last one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SessionClock {
    /// Time of the newest frame or scan of this session on its own clock, seconds.
    newest: f64,
    /// Seconds from the session's clock to the maps'; none before the first frame.
    offset: Option<f64>,
}

impl Default for SessionClock {
    fn default() -> Self {
        Self { newest: f64::NEG_INFINITY, offset: None }
    }
}

impl SessionClock {
    /// Whether no frame has come yet.
    pub(crate) fn is_new(&self) -> bool {
        self.offset.is_none()
    }

    pub(crate) fn newest(&self) -> f64 {
        self.newest
    }

    /// Notes a time of the session, and returns the offset to the maps' clock. `last`: the newest time on
    /// that clock.
    pub(crate) fn advance(&mut self, timestamp: f64, last: f64) -> f64 {
        let offset = self.offset_at(timestamp, last);
        (self.newest, self.offset) = (timestamp, Some(offset));
        offset
    }

    /// The offset that [`advance`](Self::advance) would return.
    pub(crate) fn offset_at(&self, timestamp: f64, last: f64) -> f64 {
        let follows = timestamp > last;
        self.offset.unwrap_or(if follows { 0.0 } else { last + PAUSE - timestamp })
    }

    /// Seconds from the session's clock to the maps'.
    pub(crate) fn offset(&self) -> f64 {
        self.offset.unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_whose_clock_begins_anew_follows_the_last() {
        let mut first = SessionClock::default();
        assert_eq!((first.advance(5.0, f64::NEG_INFINITY), first.advance(9.0, 5.0)), (0.0, 0.0));
        let mut anew = SessionClock::default();
        assert_eq!((anew.advance(2.0, 9.0), anew.advance(3.0, 19.0)), (17.0, 17.0));
        let mut goes_on = SessionClock::default();
        assert_eq!(goes_on.advance(1.7e9, 20.0), 0.0);
        assert_eq!((anew.newest(), anew.offset()), (3.0, 17.0));
    }
}
