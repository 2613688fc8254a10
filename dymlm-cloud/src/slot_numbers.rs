/// Numbers slots from 0 on, in the order in which they are first asked for. Clearing it keeps its memory and
/// costs what was numbered.
#[derive(Debug, Default)]
pub(crate) struct SlotNumbers {
    /// By slot: 1 + its number, or 0.
    numbers: Vec<u32>,
    /// By number.
    slots: Vec<usize>,
}

impl SlotNumbers {
    /// The number of a slot; the next one when it has none yet.
    pub(crate) fn number_or_insert(&mut self, slot: usize) -> usize {
        if slot >= self.numbers.len() {
            self.numbers.resize(slot + 1, 0);
        }
        if self.numbers[slot] == 0 {
            self.slots.push(slot);
            self.numbers[slot] = self.slots.len() as u32;
        }
        self.numbers[slot] as usize - 1
    }

    /// The number of a slot, if it has one.
    pub(crate) fn number(&self, slot: usize) -> Option<usize> {
        (*self.numbers.get(slot)? as usize).checked_sub(1)
    }

    /// The slots by their numbers.
    pub(crate) fn slots(&self) -> &[usize] {
        &self.slots
    }

    /// Bytes that the numbers take.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.numbers.capacity() * size_of::<u32>() + self.slots.capacity() * size_of::<usize>()
    }

    /// Forgets all numbers.
    pub(crate) fn clear(&mut self) {
        for slot in self.slots.drain(..) {
            self.numbers[slot] = 0;
        }
    }
}
