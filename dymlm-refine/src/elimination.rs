use std::ops::Range;

use feral_amd::{CscPattern, amd_order};

use crate::Error;

/// Greatest share of zeros among the numbers of merged columns, for supernodes of up to so many columns.
/// Columns are merged because narrow supernodes cost more to handle than to compute.
const SHARES_OF_ZEROS: [(usize, f64); 3] = [(12, 0.3), (48, 0.1), (usize::MAX, 0.02)];

/// In which order blocks of unknowns are eliminated, and the fill-in; both depend on the pattern alone.
///
/// The order is that of approximate minimum degree (AMD) among blocks. Columns with the same pattern below
/// them form a supernode, a dense front (Duff and Reid 1983; Davis, "Direct Methods for Sparse Linear
/// Systems", 4).
#[derive(Debug)]
pub(crate) struct Elimination {
    /// For each block, its position in the order.
    pub(crate) positions: Vec<usize>,
    /// For each position, where its unknowns begin; and the end of the last.
    pub(crate) starts: Vec<usize>,
    /// Each comes after all those that it depends on.
    pub(crate) supernodes: Vec<Supernode>,
}

/// Columns that are eliminated together, and the rows below them that they change.
#[derive(Debug)]
pub(crate) struct Supernode {
    /// Positions of its blocks.
    pub(crate) positions: Range<usize>,
    /// Unknowns that are eliminated here.
    pub(crate) columns: usize,
    /// The same with the unknowns of the rows below.
    pub(crate) size: usize,
    /// The rows below, as unknowns.
    pub(crate) below: Vec<Range<usize>>,
    /// Supernodes whose rows below begin in this one's columns, ascending.
    pub(crate) children: Vec<usize>,
    /// Where its rows below are among the rows of its parent.
    pub(crate) into_parent: Vec<Run>,
    /// Positions of the blocks of the rows below, and where each begins in the front.
    places: Vec<(usize, usize)>,
}

/// Rows that are consecutive in two places.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) length: usize,
}

impl Elimination {
    /// `below`: for each block, the later blocks that it is coupled with, ascending.
    pub(crate) fn new(sizes: &[usize], below: &[Vec<usize>]) -> Result<Self, Error> {
        let order = least_degree(below)?;
        let order = postorder(&order, &parents(&neighbours(&order, below)));
        let neighbours = neighbours(&order, below);
        let parents = parents(&neighbours);
        let patterns = patterns(&neighbours, &parents);

        let mut positions = vec![0; order.len()];
        let mut starts = vec![0];
        for (position, &block) in order.iter().enumerate() {
            positions[block] = position;
            starts.push(starts[position] + sizes[block]);
        }
        let groups = groups(&starts, &patterns, &parents);
        let supernodes = supernodes(&groups, &starts, &patterns);
        Ok(Self { positions, starts, supernodes })
    }
}

impl Supernode {
    /// Where the block at a position begins in the front.
    pub(crate) fn place(&self, starts: &[usize], position: usize) -> usize {
        if self.positions.contains(&position) {
            return starts[position] - starts[self.positions.start];
        }
        let found = self.places.binary_search_by_key(&position, |(position, _)| *position);
        found.map_or(self.size, |found| self.places[found].1)
    }
}

/// The blocks in the order of approximate minimum degree (Amestoy, Davis and Duff 1996).
fn least_degree(below: &[Vec<usize>]) -> Result<Vec<usize>, Error> {
    let unordered: Vec<usize> = (0..below.len()).collect();
    let (mut rows, mut columns) = (Vec::new(), vec![0]);
    for mut coupled in neighbours(&unordered, below) {
        coupled.sort_unstable();
        rows.extend(coupled.into_iter().map(|block| block as i32));
        columns.push(rows.len() as i32);
    }
    let pattern = CscPattern::new(below.len(), &columns, &rows).ok_or(Error::Singular)?;
    let order = amd_order(&pattern).map_err(|_| Error::Singular)?;
    Ok(order.into_iter().map(|block| block as usize).collect())
}

/// For each position, the positions that it is coupled with.
fn neighbours(order: &[usize], below: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut positions = vec![0; order.len()];
    for (position, &block) in order.iter().enumerate() {
        positions[block] = position;
    }
    let mut neighbours = vec![Vec::new(); order.len()];
    for (block, rows) in below.iter().enumerate() {
        for &row in rows {
            let (a, b) = (positions[block], positions[row]);
            neighbours[a].push(b);
            neighbours[b].push(a);
        }
    }
    neighbours
}

/// The elimination tree: for each position, the first later one that its elimination changes (Liu 1990).
fn parents(neighbours: &[Vec<usize>]) -> Vec<Option<usize>> {
    let mut parents: Vec<Option<usize>> = vec![None; neighbours.len()];
    // Short cuts towards the root.
    let mut ancestors: Vec<Option<usize>> = vec![None; neighbours.len()];
    for (position, neighbours) in neighbours.iter().enumerate() {
        for &neighbour in neighbours.iter().filter(|&&neighbour| neighbour < position) {
            let mut at = neighbour;
            while let Some(next) = ancestors[at].replace(position) {
                if next == position {
                    break;
                }
                at = next;
            }
            if at != position && parents[at].is_none() {
                parents[at] = Some(position);
            }
        }
    }
    parents
}

/// An equivalent order of elimination in which each subtree is in one piece.
fn postorder(order: &[usize], parents: &[Option<usize>]) -> Vec<usize> {
    let mut children = vec![Vec::new(); order.len()];
    let mut waiting = Vec::new();
    for (position, parent) in parents.iter().enumerate() {
        match parent {
            Some(parent) => children[*parent].push(position),
            None => waiting.push(position),
        }
    }
    let mut reversed = Vec::with_capacity(order.len());
    while let Some(position) = waiting.pop() {
        reversed.push(order[position]);
        waiting.append(&mut children[position]);
    }
    reversed.reverse();
    reversed
}

/// For each position, those below the diagonal that are not zero in the factor, ascending.
fn patterns(neighbours: &[Vec<usize>], parents: &[Option<usize>]) -> Vec<Vec<usize>> {
    let mut patterns: Vec<Vec<usize>> = neighbours
        .iter()
        .enumerate()
        .map(|(position, neighbours)| neighbours.iter().copied().filter(|&row| row > position).collect())
        .collect();
    for (position, parent) in parents.iter().enumerate() {
        patterns[position].sort_unstable();
        patterns[position].dedup();
        if let Some(parent) = *parent {
            let (own, later) = patterns.split_at_mut(position + 1);
            let rows = own[position].iter().copied().filter(|&row| row > parent);
            later[parent - position - 1].extend(rows);
        }
    }
    patterns
}

/// Consecutive positions, and how many numbers of their columns are not zero.
struct Group {
    positions: Range<usize>,
    numbers: usize,
}

/// The groups of positions that are eliminated together.
fn groups(starts: &[usize], patterns: &[Vec<usize>], parents: &[Option<usize>]) -> Vec<Group> {
    let unknowns = |positions: &Range<usize>| starts[positions.end] - starts[positions.start];
    let all_numbers = |positions: &Range<usize>| {
        let below = &patterns[positions.end - 1];
        let rows: usize = below.iter().map(|&row| starts[row + 1] - starts[row]).sum();
        let columns = unknowns(positions);
        columns * (columns + 1) / 2 + columns * rows
    };
    let mut groups: Vec<Group> = Vec::new();
    for position in 0..patterns.len() {
        let own = position..position + 1;
        let mut group = Group { numbers: all_numbers(&own), positions: own };
        // The group before this one can be merged when its parent is in this one.
        while let Some(last) = groups.last()
            && parents[last.positions.end - 1].is_some_and(|parent| parent < group.positions.end)
        {
            let merged = last.positions.start..group.positions.end;
            let (all, numbers) = (all_numbers(&merged), last.numbers + group.numbers);
            let columns = unknowns(&merged);
            let share =
                SHARES_OF_ZEROS.iter().find(|(most, _)| columns <= *most).map_or(0.0, |(_, share)| *share);
            if (all - numbers) as f64 > share * all as f64 {
                break;
            }
            group = Group { positions: merged, numbers };
            groups.pop();
        }
        groups.push(group);
    }
    groups
}

fn supernodes(groups: &[Group], starts: &[usize], patterns: &[Vec<usize>]) -> Vec<Supernode> {
    let mut group_of = vec![0; patterns.len()];
    let mut supernodes: Vec<Supernode> = Vec::with_capacity(groups.len());
    for (index, group) in groups.iter().enumerate() {
        group_of[group.positions.clone()].fill(index);
        let positions = group.positions.clone();
        let columns = starts[positions.end] - starts[positions.start];
        let (mut size, mut places, mut below) = (columns, Vec::new(), Vec::<Range<usize>>::new());
        for &row in &patterns[positions.end - 1] {
            let unknowns = starts[row]..starts[row + 1];
            places.push((row, size));
            size += unknowns.len();
            match below.last_mut().filter(|last| last.end == unknowns.start) {
                Some(last) => last.end = unknowns.end,
                None => below.push(unknowns),
            }
        }
        let (children, into_parent) = (Vec::new(), Vec::new());
        supernodes.push(Supernode { positions, columns, size, below, children, into_parent, places });
    }
    for index in 0..supernodes.len() {
        let Some(&(first, _)) = supernodes[index].places.first() else { continue };
        let (node, parent) = (&supernodes[index], &supernodes[group_of[first]]);
        let mut runs: Vec<Run> = Vec::new();
        for &(row, place) in &node.places {
            let (from, to) = (place - node.columns, parent.place(starts, row));
            let length = starts[row + 1] - starts[row];
            let follows = |run: &&mut Run| run.from + run.length == from && run.to + run.length == to;
            match runs.last_mut().filter(follows) {
                Some(run) => run.length += length,
                None => runs.push(Run { from, to, length }),
            }
        }
        supernodes[index].into_parent = runs;
        supernodes[group_of[first]].children.push(index);
    }
    supernodes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_fills_nothing_in() {
        let below: Vec<Vec<usize>> =
            (0..100).map(|block| if block < 99 { vec![block + 1] } else { vec![] }).collect();
        let elimination = Elimination::new(&[6; 100], &below).unwrap();
        let mut positions = elimination.positions.clone();
        positions.sort_unstable();
        assert_eq!(positions, (0..100).collect::<Vec<_>>());
        let columns: usize = elimination.supernodes.iter().map(|node| node.columns).sum();
        assert_eq!(columns, 600);
        // Besides its columns, a supernode has only what is left of the chain on either side.
        assert!(elimination.supernodes.iter().all(|node| node.size <= node.columns + 2 * 6));
    }

    #[test]
    fn the_middle_of_a_star_comes_late() {
        let below: Vec<Vec<usize>> =
            (0..50).map(|block| if block == 0 { (1..50).collect() } else { vec![] }).collect();
        let elimination = Elimination::new(&[3; 50], &below).unwrap();
        assert!(elimination.positions[0] >= 48);
        assert!(elimination.supernodes.iter().all(|node| node.size <= 2 * 3 + node.columns));
    }
}
