// The planes: polygons with holes, half-transparent, each in the colour of its id.

import * as THREE from "three";
import { ringPairs, segments } from "./lines.js";

const OPACITY = 0.32;
const SELECTED_OPACITY = 0.75;

export function planeLayer(planes) {
    const group = new THREE.Group();
    group.add(...planes.map(planeObject));
    return group;
}

/** A plane is filled only on the side from which it was seen, so that one can look into a room from outside. */
function planeObject(plane) {
    const color = new THREE.Color(...plane.color.map((channel) => channel / 255));
    const material = new THREE.MeshBasicMaterial({
        color, transparent: true, opacity: OPACITY, depthWrite: false,
        // The fill is drawn before the points of the same surface.
        polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1,
    });
    const mesh = new THREE.Mesh(polygonGeometry(plane), material);
    const rings = plane.polygons.flatMap(({ outline, holes }) => [outline, ...holes]);
    const outline = segments(rings.flatMap(ringPairs), color, 1.5);
    const object = new THREE.Group();
    object.add(mesh, outline);
    mesh.userData.thing = { kind: "plane", id: plane.id };
    object.userData = {
        thing: mesh.userData.thing,
        anchor: () => largestTriangleCenter(mesh.geometry),
        select: (isSelected) => {
            material.opacity = isSelected ? SELECTED_OPACITY : OPACITY;
            outline.material.linewidth = isSelected ? 4 : 1.5;
        },
    };
    return object;
}

/** The polygons, triangulated in the plane, with corners in the world. */
function polygonGeometry(plane) {
    const [across, along] = axesOf(plane.normal);
    const flat = (ring) => ring.map((corner) => {
        const place = new THREE.Vector3(...corner);
        return new THREE.Vector2(place.dot(across), place.dot(along));
    });
    const [positions, indices] = [[], []];
    for (const { outline, holes } of plane.polygons) {
        const first = positions.length / 3;
        positions.push(...[outline, ...holes].flat(2));
        const triangles = THREE.ShapeUtils.triangulateShape(flat(outline), holes.map(flat));
        indices.push(...triangles.flat().map((index) => first + index));
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
    geometry.setIndex(indices);
    return geometry;
}

/** Two axes of a plane that form a right-handed frame with its normal, so that triangles face along the normal. */
function axesOf(normal) {
    const out = new THREE.Vector3(...normal).normalize();
    const other = Math.abs(out.x) < 0.9 ? new THREE.Vector3(1, 0, 0) : new THREE.Vector3(0, 1, 0);
    const across = new THREE.Vector3().crossVectors(other, out).normalize();
    return [across, new THREE.Vector3().crossVectors(out, across)];
}

/** A place that is surely on the plane; its middle may be in a hole. */
function largestTriangleCenter(geometry) {
    const [places, index] = [geometry.getAttribute("position"), geometry.getIndex()];
    const triangle = new THREE.Triangle();
    const best = { area: -1, center: new THREE.Vector3() };
    for (let corner = 0; corner < index.count; corner += 3) {
        triangle.setFromAttributeAndIndices(places, index.getX(corner), index.getX(corner + 1), index.getX(corner + 2));
        if (triangle.getArea() > best.area) {
            best.area = triangle.getArea();
            triangle.getMidpoint(best.center);
        }
    }
    return best.center;
}
