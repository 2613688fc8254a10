// Lets the viewer look into a room from outside: points and cells of walls and ceilings are not drawn when
// the camera is behind them.

import * as THREE from "three";

/** Largest distance of a wall's points from its plane, metres. */
const REACH = 0.06;
/** Smallest area of a wall or ceiling, square metres: smaller planes are sides of things. */
const LEAST_AREA = 0.8;

/** Uniform shared by all materials: 1 when outer sides are hidden. */
const isHiding = { value: 1 };

/** Shows or hides the outer sides of everything drawn with a material that was passed to `hideOuterSide`. */
export function hideOuterSides(isHidden) {
    isHiding.value = isHidden ? 1 : 0;
}

/**
 * The direction into the room for each place on a wall or ceiling, four signed bytes per place (the last is
 * padding); zeros for all other places.
 */
export function inwardDirections(positions, planes, up) {
    const walls = planes.filter((plane) => plane.area >= LEAST_AREA && isOuter(plane, up)).map(wallOf);
    const directions = new Int8Array((positions.length / 3) * 4);
    const place = new THREE.Vector3();
    for (let index = 0; 4 * index < directions.length; index += 1) {
        place.fromArray(positions, 3 * index);
        let [nearest, distance] = [null, REACH];
        for (const wall of walls) {
            const off = Math.abs(place.dot(wall.normal) - wall.offset);
            if (off < distance && wall.box.containsPoint(place)) {
                [nearest, distance] = [wall, off];
            }
        }
        if (nearest) {
            directions.set(nearest.bytes, 4 * index);
        }
    }
    return directions;
}

/** Whether a plane is a wall (upright) or a ceiling (seen from below). */
function isOuter({ normal }, up) {
    const rise = up.reduce((sum, value, axis) => sum + value * normal[axis], 0);
    return Math.abs(rise) < 0.3 || rise < -0.9;
}

function wallOf(plane) {
    const normal = new THREE.Vector3(...plane.normal);
    const corners = plane.polygons.flatMap(({ outline }) => outline).map((corner) => new THREE.Vector3(...corner));
    return {
        normal,
        offset: normal.dot(new THREE.Vector3(...plane.centroid)),
        box: new THREE.Box3().setFromPoints(corners).expandByScalar(REACH),
        bytes: plane.normal.map((value) => Math.round(127 * value)),
    };
}

/** Adds a test of the attribute `inward` to a material's shader. */
export function hideOuterSide(material) {
    material.onBeforeCompile = (shader) => {
        shader.uniforms.isHidingOuterSides = isHiding;
        shader.vertexShader = shader.vertexShader
            .replace("void main() {", `attribute vec4 inward;
                uniform float isHidingOuterSides;
                void main() {`)
            .replace("#include <fog_vertex>", `#include <fog_vertex>
                #ifdef USE_INSTANCING
                    vec4 placeInWorld = modelMatrix * instanceMatrix * vec4(0.0, 0.0, 0.0, 1.0);
                #else
                    vec4 placeInWorld = modelMatrix * vec4(position, 1.0);
                #endif
                if (isHidingOuterSides * dot(mat3(modelMatrix) * inward.xyz, cameraPosition - placeInWorld.xyz) < 0.0) {
                    // Off the picture.
                    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
                }`);
    };
}
