// The planes and objects that can be chosen, by a click or from the lists, and the chosen one.

const LAYER_OF = { plane: "planes", object: "objects", gone: "gone" };

export class Things {
    constructor(viewer, layers, onSelect) {
        Object.assign(this, { viewer, layers, onSelect, selected: null });
    }

    /** Its object in the scene; null while its layer has not been shown. */
    objectOf({ kind, id }) {
        const group = this.layers[LAYER_OF[kind]].object;
        return group?.children.find((child) => child.userData.thing.id === id) ?? null;
    }

    /** Chooses a thing {kind, id}, or nothing. */
    async select(thing, { turnTo = false } = {}) {
        this.mark(false);
        this.selected = thing;
        this.onSelect(thing);
        if (thing) {
            await this.layers[LAYER_OF[thing.kind]].show(true);
            if (turnTo) {
                this.viewer.lookAt(this.anchorOf(thing));
            }
        }
        this.mark(true);
        this.viewer.draw();
    }

    mark(isSelected) {
        if (this.selected) {
            this.objectOf(this.selected)?.userData.select(isSelected);
        }
    }

    /** A place on it, in the rotated world. */
    anchorOf(thing) {
        const place = this.objectOf(thing).userData.anchor();
        return this.viewer.world.localToWorld(place);
    }
}
