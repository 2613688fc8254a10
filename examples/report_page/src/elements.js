// Builds the page's elements without markup in strings, so that no label of a detector becomes markup.

/** An element with attributes (`class`, `text`, listeners as onclick) and children. */
export function element(tag, attributes = {}, children = []) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
        if (name === "text") {
            made.textContent = value;
        } else if (name.startsWith("on")) {
            made.addEventListener(name.slice(2), value);
        } else if (value !== undefined && value !== null) {
            made.setAttribute(name, value);
        }
    }
    made.append(...children);
    return made;
}

/** The same for SVG. */
export function svg(tag, attributes = {}, children = []) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) {
        if (name === "text") {
            made.textContent = value;
        } else {
            made.setAttribute(name, value);
        }
    }
    made.append(...children);
    return made;
}
