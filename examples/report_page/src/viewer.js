// The 3D view: renderer, camera and controls. It draws when something has changed, not all the time.

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

// Colours are shown as they are in the maps.
THREE.ColorManagement.enabled = false;

const BACKGROUND = 0xf4f6f8;
/** From where a room is seen at first: from above a corner. */
const OBLIQUE = new THREE.Vector3(0.55, 0.75, 0.8).normalize();
const DIRECTIONS = { oblique: OBLIQUE, above: new THREE.Vector3(0, 1, 1e-4), side: new THREE.Vector3(0, 0.12, 1) };

export class Viewer {
    /** Throws when the browser has no WebGL. */
    constructor(canvas) {
        this.canvas = canvas;
        this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
        this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
        this.renderer.setClearColor(BACKGROUND);
        this.scene = new THREE.Scene();
        this.camera = new THREE.PerspectiveCamera(50, 1, 0.05, 500);
        // All maps hang in here, turned so that the world's up is the view's.
        this.world = new THREE.Group();
        this.scene.add(this.world, ...lights());
        this.controls = new OrbitControls(this.camera, canvas);
        this.controls.listenToKeyEvents(canvas);
        this.controls.addEventListener("change", () => this.draw());
        this.isDue = false;
        this.afterDraw = [];
        new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    }

    /** Turns the world so that `up` shows up and `level`, at right angles to it, to the right. */
    setUp(up, level) {
        const y = new THREE.Vector3(...up).normalize();
        const x = new THREE.Vector3(...level);
        x.addScaledVector(y, -x.dot(y)).normalize();
        const z = new THREE.Vector3().crossVectors(x, y);
        this.world.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(x, y, z).transpose());
        this.world.updateMatrixWorld(true);
    }

    /** What the views fit in: a box of the turned world. */
    setBounds(bounds) {
        this.bounds = bounds;
        const far = bounds.getSize(new THREE.Vector3()).length();
        this.camera.near = Math.max(0.01, far / 2000);
        this.camera.far = 20 * far;
        this.controls.maxDistance = 8 * far;
        this.controls.minDistance = 0.05;
    }

    /** Shows all of it from one of the DIRECTIONS. */
    show(direction) {
        const center = this.bounds.getCenter(new THREE.Vector3());
        const toEye = DIRECTIONS[direction].clone().normalize();
        this.camera.position.copy(center).addScaledVector(toEye, this.fittingDistance(center, toEye));
        this.controls.target.copy(center);
        this.camera.updateProjectionMatrix();
        this.controls.update();
        this.draw();
    }

    /** The least distance from which no corner of the bounds is off the picture. */
    fittingDistance(center, toEye) {
        this.camera.position.copy(center).add(toEye);
        this.camera.lookAt(center);
        const toCamera = this.camera.quaternion.clone().invert();
        const tangent = Math.tan(THREE.MathUtils.degToRad(this.camera.fov / 2));
        const { min, max } = this.bounds;
        let distance = 0;
        for (let corner = 0; corner < 8; corner += 1) {
            const place = new THREE.Vector3(
                corner & 1 ? max.x : min.x, corner & 2 ? max.y : min.y, corner & 4 ? max.z : min.z,
            ).sub(center).applyQuaternion(toCamera);
            const across = Math.max(Math.abs(place.x) / this.camera.aspect, Math.abs(place.y)) / tangent;
            distance = Math.max(distance, across + place.z);
        }
        return 1.04 * Math.max(distance, 0.5);
    }

    /** Turns to look at a place of the turned world, from where the camera is. */
    lookAt(place) {
        this.controls.target.copy(place);
        this.controls.update();
        this.draw();
    }

    /** Hides everything above a height of the turned world. */
    cutAbove(height) {
        this.cutHeight = height;
        this.renderer.clippingPlanes =
            height === Infinity ? [] : [new THREE.Plane(new THREE.Vector3(0, -1, 0), height)];
        this.draw();
    }

    /** Whether the cut leaves a place of the turned world to be seen. */
    isBelowCut(place) {
        return place.y <= (this.cutHeight ?? Infinity);
    }

    /** Draws at the browser's next turn. */
    draw() {
        if (!this.isDue) {
            this.isDue = true;
            requestAnimationFrame(() => {
                this.isDue = false;
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

function lights() {
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(0.4, 1, 0.7);
    const back = new THREE.DirectionalLight(0xffffff, 0.5);
    back.position.set(-0.6, 0.3, -0.8);
    return [sun, back, new THREE.AmbientLight(0xffffff, 1.5)];
}
