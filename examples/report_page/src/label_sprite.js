// A text that always faces the viewer and always has the same size.

import * as THREE from "three";

/** Height of a label as a share of the view's height. */
const HEIGHT = 0.026;
const FONT_SIZE = 44;

export function labelSprite(text, cssColor) {
    const canvas = document.createElement("canvas");
    const context = canvas.getContext("2d");
    const font = `600 ${FONT_SIZE}px system-ui, sans-serif`;
    context.font = font;
    canvas.width = Math.ceil(context.measureText(text).width) + 40;
    canvas.height = 64;
    context.font = font;
    context.fillStyle = "rgba(255, 255, 255, 0.88)";
    context.beginPath();
    context.roundRect(2, 2, canvas.width - 4, canvas.height - 4, 16);
    context.fill();
    context.lineWidth = 4;
    context.strokeStyle = cssColor;
    context.stroke();
    context.fillStyle = "#1c2733";
    context.textBaseline = "middle";
    context.fillText(text, 20, canvas.height / 2 + 2);

    const texture = new THREE.CanvasTexture(canvas);
    const material = new THREE.SpriteMaterial({ map: texture, sizeAttenuation: false, depthTest: false });
    const sprite = new THREE.Sprite(material);
    sprite.scale.set((HEIGHT * canvas.width) / canvas.height, HEIGHT, 1);
    sprite.center.set(0.5, -0.2);
    sprite.renderOrder = 10;
    return sprite;
}
