use dymlm_core::{BitReader, BitWriter};

use super::voxel_code::{next_block, put_block};
use crate::CloudMap;
use crate::block_store::{BlockKey, BlockStore};
use crate::voxel_block::VoxelBlock;

/// About as many as a voxel takes, with the places of its block.
const BYTES_A_VOXEL: usize = 16;

/// The voxels of a block; `None` where there is no block.
pub(super) fn voxels_of(key: BlockKey, store: &BlockStore<VoxelBlock>) -> Option<Vec<u8>> {
    let block = store.blocks()[store.slot(key)?].look();
    let mut bits = BitWriter::with_capacity(BYTES_A_VOXEL * block.len());
    put_block(&block, &mut bits);
    let mut bytes = Vec::new();
    bits.finish(&mut bytes);
    Some(bytes)
}

/// Puts the voxels into a map that has none in the block; `None` for voxels that no map can hold.
pub(super) fn put_voxels(mut bytes: &[u8], key: BlockKey, map: &mut CloudMap) -> Option<()> {
    let mut bits = BitReader::take(&mut bytes)?;
    let block = next_block(&mut bits)?;
    if !bytes.is_empty() || !bits.is_done() {
        return None;
    }
    map.put_block(key, block);
    Some(())
}
