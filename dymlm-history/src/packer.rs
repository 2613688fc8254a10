use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

use crate::Observation;
use crate::kept::Kept;
use crate::packing_buffers::PackingBuffers;

/// Most observations and scans that wait to be packed: a second of key frames. A caller that adds more waits.
const MOST_WAITING: usize = 8;

/// A number, and the bytes of what is kept under it.
type Packed = (usize, Box<[u8]>);

/// Packs observations and scans on a thread of its own, in their order; on the caller's thread where the
/// system gives none.
#[derive(Debug, Default)]
pub(crate) struct Packer {
    /// None before the first thing to pack.
    thread: Option<PackingThread>,
    /// What has been packed and not yet been taken, apart from what is in `done`.
    ready: VecDeque<Packed>,
    waiting: usize,
    /// An observation that has been packed, for its buffers.
    spare: Option<Arc<Observation>>,
}

/// The thread ends when the packer is dropped.
#[derive(Debug)]
struct PackingThread {
    /// `None` where the system gives no thread.
    work: Option<SyncSender<(usize, Kept)>>,
    /// It is never locked: the mutex only makes types that hold a packer `Sync`.
    done: Mutex<Receiver<Packed>>,
}

impl Clone for Packer {
    /// A packer with a thread of its own and nothing to pack.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PackingThread {
    fn new() -> Self {
        let (work, tasks) = sync_channel::<(usize, Kept)>(MOST_WAITING);
        let (results, done) = channel();
        let run = move || {
            let mut buffers = PackingBuffers::default();
            for (index, kept) in tasks {
                let packed = kept.pack(&mut buffers);
                // Before the bytes are taken, so that whoever takes them can use its buffers again.
                drop(kept);
                if results.send((index, packed)).is_err() {
                    return;
                }
            }
        };
        let thread = std::thread::Builder::new().name("dymlm-history".into()).spawn(run);
        let work = thread.is_ok().then_some(work);
        Self { work, done: Mutex::new(done) }
    }

    fn done(&mut self) -> &mut Receiver<Packed> {
        self.done.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Packer {
    /// Gives something to the thread, to be packed.
    pub(crate) fn pack(&mut self, index: usize, kept: Kept) {
        let task = (index, kept);
        let undone = match &self.thread.get_or_insert_with(PackingThread::new).work {
            Some(work) => work.send(task).err().map(|refused| refused.0),
            None => Some(task),
        };
        match undone {
            Some((index, kept)) => self.ready.push_back((index, kept.pack(&mut PackingBuffers::default()))),
            None => self.waiting += 1,
        }
    }

    /// One thing that has been packed; `None` when none is ready.
    pub(crate) fn next(&mut self) -> Option<Packed> {
        self.ready.pop_front().or_else(|| {
            let packed = self.thread.as_mut()?.done().try_recv().ok()?;
            self.waiting -= 1;
            Some(packed)
        })
    }

    /// Takes back what has been packed, for its buffers.
    pub(crate) fn recycle(&mut self, kept: Kept) {
        if let Kept::Observation(observation) = kept {
            self.spare = Some(observation);
        }
    }

    /// An observation that nobody needs any more, if there is one.
    pub(crate) fn spare(&mut self) -> Option<Observation> {
        Arc::into_inner(self.spare.take()?)
    }

    /// Waits until everything that was given has been packed.
    pub(crate) fn finish(&mut self) {
        let Some(thread) = &mut self.thread else { return };
        while self.waiting > 0 {
            let Ok(packed) = thread.done().recv() else { return };
            self.waiting -= 1;
            self.ready.push_back(packed);
        }
    }
}
