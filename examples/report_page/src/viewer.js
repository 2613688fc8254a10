// The 3D view: renderer, camera and controls. It draws only when something has changed.

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

// Colours are shown as they are in the maps.
THREE.ColorManagement.enabled = false;

const BACKGROUND = 0xf4f6f8;
/** How far the eye is above the horizon in each view, radians. */
const ELEVATION = { oblique: 0.7, above: Math.PI / 2 - 1e-3, side: 0.1 };
/** Angle beside the camera's direction of view, radians: edges of walls do not coincide in the picture. */
const BESIDE = 0.4;
/** Share of the places that may be outside the picture: strays. */
const OFF_PICTURE = 0.006;

export class Viewer {
    /** Throws when the browser has no WebGL. */
    constructor(canvas) {
        this.canvas = canvas;
        this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
        this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
        this.renderer.setClearColor(BACKGROUND);
        this.scene = new THREE.Scene();
        this.camera = new THREE.PerspectiveCamera(50, 1, 0.05, 500);
        // The group of all maps, rotated so that the world's up is the view's.
        this.world = new THREE.Group();
        this.scene.add(this.world, ...lights());
        this.controls = new OrbitControls(this.camera, canvas);
        this.controls.listenToKeyEvents(canvas);
        this.controls.addEventListener("change", () => this.draw());
        this.isDue = false;
        this.beforeDraw = [];
        this.afterDraw = [];
        new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    }

    /** Rotates the world so that `up` points up and `level`, at right angles to it, to the right. */
    setUp(up, level) {
        const y = new THREE.Vector3(...up).normalize();
        const x = new THREE.Vector3(...level);
        x.addScaledVector(y, -x.dot(y)).normalize();
        const z = new THREE.Vector3().crossVectors(x, y);
        this.world.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(x, y, z).transpose());
        this.world.updateMatrixWorld(true);
    }

    /**
     * Sets what must be in the picture: places of the rotated world, nearly all of the first list and all of the
     * second; also the bounds of the first list, and the level direction in which the camera mostly looked.
     */
    setScene(places, wholePlaces, bounds, lookedAlong) {
        Object.assign(this, { places, wholePlaces, bounds });
        this.azimuth = lookedAlong.lengthSq() > 0 ? Math.atan2(-lookedAlong.x, -lookedAlong.z) + BESIDE : BESIDE;
        const far = bounds.getSize(new THREE.Vector3()).length();
        this.camera.near = Math.max(0.01, far / 2000);
        this.camera.far = 20 * far;
        this.controls.maxDistance = 8 * far;
        this.controls.minDistance = 0.05;
    }

    /** Shows all of it: "oblique", from "above" or from the "side". */
    show(direction) {
        const azimuth = direction === "oblique" ? this.azimuth : this.azimuth - BESIDE;
        const toEye = new THREE.Vector3().setFromSphericalCoords(1, Math.PI / 2 - ELEVATION[direction], azimuth);
        this.controls.target.copy(this.bounds.getCenter(new THREE.Vector3()));
        // Nearer parts look larger, so the picture's middle depends on the distance: a few rounds settle
        // both.
        let distance = 10 * this.camera.far;
        for (let round = 0; round < 4; round += 1) {
            distance = this.fit(toEye, distance);
        }
        this.camera.updateProjectionMatrix();
        this.controls.update();
        this.draw();
    }

    /** Centres the places in the picture at a distance, and returns the nearest distance that shows them all. */
    fit(toEye, distance) {
        const { camera, controls: { target } } = this;
        camera.position.copy(target).add(toEye);
        camera.lookAt(target);
        camera.updateMatrixWorld();
        const [right, up] = [new THREE.Vector3(), new THREE.Vector3()];
        camera.matrixWorld.extractBasis(right, up, new THREE.Vector3());
        const seen = (places) => places.map((place) => {
            const off = place.clone().sub(target);
            return [off.dot(right), off.dot(up), off.dot(toEye)];
        });
        const most = seen(this.places);
        const middle = (axis) => {
            const shares = most.map((place) => place[axis] / Math.max(distance - place[2], 0.01));
            return (distance * (quantile(shares, OFF_PICTURE / 2) + quantile(shares, 1 - OFF_PICTURE / 2))) / 2;
        };
        target.addScaledVector(right, middle(0)).addScaledVector(up, middle(1));

        const tangent = Math.tan(THREE.MathUtils.degToRad(camera.fov / 2));
        const needed = ([x, y, z]) => Math.max(Math.abs(x) / camera.aspect, Math.abs(y)) / tangent + z;
        const found = Math.max(
            0.5, quantile(seen(this.places).map(needed), 1 - OFF_PICTURE), ...seen(this.wholePlaces).map(needed),
        );
        camera.position.copy(target).addScaledVector(toEye, 1.08 * found);
        return 1.08 * found;
    }

    /** Turns to look at a place of the rotated world, without moving the camera. */
    lookAt(place) {
        this.controls.target.copy(place);
        this.controls.update();
        this.draw();
    }

    /** Hides everything above a height in the rotated world. */
    cutAbove(height) {
        this.cutHeight = height;
        this.renderer.clippingPlanes =
            height === Infinity ? [] : [new THREE.Plane(new THREE.Vector3(0, -1, 0), height)];
        this.draw();
    }

    /** Whether a place of the rotated world is below the cut, and so visible. */
    isBelowCut(place) {
        return place.y <= (this.cutHeight ?? Infinity);
    }

    /** Draws in the browser's next animation frame. */
    draw() {
        if (!this.isDue) {
            this.isDue = true;
            requestAnimationFrame(() => {
                this.isDue = false;
                this.beforeDraw.forEach((listener) => listener());
                this.renderer.render(this.scene, this.camera);
                this.afterDraw.forEach((listener) => listener());
            });
        }
    }

    resize() {
        const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
        if (width > 0 && height > 0) {
            this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
            this.renderer.setSize(width, height, false);
            this.camera.aspect = width / height;
            this.camera.updateProjectionMatrix();
            this.draw();
        }
    }
}

function quantile(values, share) {
    const sorted = values.toSorted((one, other) => one - other);
    return sorted[Math.min(sorted.length - 1, Math.max(0, Math.round(share * (sorted.length - 1))))] ?? 0;
}

function lights() {
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(0.4, 1, 0.7);
    const back = new THREE.DirectionalLight(0xffffff, 0.5);
    back.position.set(-0.6, 0.3, -0.8);
    return [sun, back, new THREE.AmbientLight(0xffffff, 1.5)];
}
