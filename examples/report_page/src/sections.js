// Unpacks the packed sections of the page: base64 of a zlib stream of numbers, written by
// examples/src/report_page/section.rs.

/** The JSON part of the page. */
export function readData() {
    return JSON.parse(document.getElementById("page-data").textContent);
}

/**
 * Unpacks places on a lattice: Float32Array of x y z, metres, world, and their byte channels. `layer` is
 * {section, count, origin, step, channels}.
 */
export async function readPlaces(layer) {
    const bytes = await inflate(fromBase64(document.getElementById(`section-${layer.section}`).textContent));
    const { count, channels } = layer;
    if (bytes.length !== count * (6 + channels)) {
        throw new Error(`section ${layer.section}: ${bytes.length} bytes for ${count} places`);
    }
    const positions = new Float32Array(3 * count);
    for (let axis = 0; axis < 3; axis += 1) {
        const low = bytes.subarray(2 * axis * count, (2 * axis + 1) * count);
        const high = bytes.subarray((2 * axis + 1) * count, (2 * axis + 2) * count);
        let key = 0;
        for (let index = 0; index < count; index += 1) {
            key = (key + fromZigzag(low[index] | (high[index] << 8))) & 0xffff;
            positions[3 * index + axis] = layer.origin[axis] + key * layer.step;
        }
    }
    return { positions, channels: readChannels(bytes.subarray(6 * count), count, channels) };
}

/** Byte channels, interleaved: `channels` bytes per place. */
function readChannels(bytes, count, channels) {
    const values = new Uint8Array(count * channels);
    for (let channel = 0; channel < channels; channel += 1) {
        let value = 0;
        for (let index = 0; index < count; index += 1) {
            value = (value + bytes[channel * count + index]) & 0xff;
            values[channels * index + channel] = value;
        }
    }
    return values;
}

/** Zigzag decoding: 0, 1, 2, 3, 4 ... to 0, -1, 1, -2, 2 ... */
function fromZigzag(code) {
    return (code >>> 1) ^ -(code & 1);
}

function fromBase64(text) {
    const binary = atob(text.trim());
    const bytes = new Uint8Array(binary.length);
    for (let index = 0; index < binary.length; index += 1) {
        bytes[index] = binary.charCodeAt(index);
    }
    return bytes;
}

async function inflate(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}
