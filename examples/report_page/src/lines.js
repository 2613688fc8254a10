// Lines with a width in pixels, which WebGL's own lines do not have.

import * as THREE from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";

/** `pairs` are x y z of the two ends of each segment, one after the other. */
export function segments(pairs, color, width, options = {}) {
    const geometry = new LineSegmentsGeometry().setPositions(pairs);
    const material = new LineMaterial({ color, linewidth: width, ...options });
    const lines = new LineSegments2(geometry, material);
    if (material.dashed) {
        lines.computeLineDistances();
    }
    // Clicks go through lines.
    lines.raycast = () => {};
    return lines;
}

/** The pairs of a ring of [x, y, z]. */
export function ringPairs(ring) {
    return ring.flatMap((corner, index) => [...corner, ...ring[(index + 1) % ring.length]]);
}

/** The pairs along a way of [x, y, z]. */
export function wayPairs(way) {
    return way.slice(1).flatMap((place, index) => [...way[index], ...place]);
}

/** The pairs of the edges of a box of side 1 around the origin. */
export function boxPairs() {
    const edges = new THREE.EdgesGeometry(new THREE.BoxGeometry());
    return [...edges.getAttribute("position").array];
}

/** The pairs of three circles of diameter 1 around the origin, one across each axis. */
export function sphereCirclePairs(steps = 48) {
    const circle = (first, second) => Array.from({ length: steps }, (_, step) => {
        const angle = (2 * Math.PI * step) / steps;
        const place = [0, 0, 0];
        place[first] = Math.cos(angle) / 2;
        place[second] = Math.sin(angle) / 2;
        return place;
    });
    return [[0, 1], [1, 2], [2, 0]].flatMap(([first, second]) => ringPairs(circle(first, second)));
}
