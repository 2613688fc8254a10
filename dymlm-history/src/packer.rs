use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

use crate::Observation;
use crate::packing::pack;

/// Observations that wait to be packed, at most: a second of key frames. Whoever adds more waits.
const MOST_WAITING: usize = 8;

/// An observation, by its number, as bytes.
type Packed = (usize, Box<[u8]>);

/// Packs observations on a thread of its own, in their order; on the caller's where there are no threads.
#[derive(Debug)]
pub(crate) struct Packer {
    /// `None` where there is no thread.
    work: Option<SyncSender<(usize, Arc<Observation>)>>,
    /// Locked by nobody: so that whoever holds a packer can be shared between threads.
    done: Mutex<Receiver<Packed>>,
    /// What the caller has packed.
    ready: VecDeque<Packed>,
    waiting: usize,
}

impl Packer {
    pub(crate) fn new() -> Self {
        let (work, tasks) = sync_channel::<(usize, Arc<Observation>)>(MOST_WAITING);
        let (results, done) = channel();
        let run = move || {
            for (index, observation) in tasks {
                if results.send((index, pack(&observation))).is_err() {
                    return;
                }
            }
        };
        // It ends when there is no packer any more.
        let thread = std::thread::Builder::new().name("dymlm-history".into()).spawn(run);
        let work = thread.is_ok().then_some(work);
        Self { work, done: Mutex::new(done), ready: VecDeque::new(), waiting: 0 }
    }

    /// Has an observation packed.
    pub(crate) fn pack(&mut self, index: usize, observation: Arc<Observation>) {
        let task = (index, observation);
        let undone = match &self.work {
            Some(work) => work.send(task).err().map(|refused| refused.0),
            None => Some(task),
        };
        match undone {
            Some((index, observation)) => self.ready.push_back((index, pack(&observation))),
            None => self.waiting += 1,
        }
    }

    /// One that has been packed; `None` when none has been yet.
    pub(crate) fn next(&mut self) -> Option<Packed> {
        self.ready.pop_front().or_else(|| {
            let packed = self.done().try_recv().ok()?;
            self.waiting -= 1;
            Some(packed)
        })
    }

    /// Waits until all that was given has been packed.
    pub(crate) fn finish(&mut self) {
        while self.waiting > 0 {
            let Ok(packed) = self.done().recv() else { return };
            self.waiting -= 1;
            self.ready.push_back(packed);
        }
    }

    fn done(&mut self) -> &mut Receiver<Packed> {
        self.done.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}
