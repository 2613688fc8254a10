// A stacked plot of values over time, used for the times of the steps and for the memory of the maps.

import { SERIES } from "./colors.js";
import { element, svg } from "./elements.js";
import { seconds } from "./format.js";

const [WIDTH, HEIGHT] = [640, 230];
const MARGIN = { left: 54, right: 10, top: 10, bottom: 30 };

/**
 * `times` in seconds; `series` are {name, values}, one value for each time; `format` formats a value, `unit`
 * is the axis's unit. `scale` is the divisor of values at the axis.
 */
export function stackedPlot({ times, series, format, unit, scale = 1, label }) {
    const columns = columnsOf(times, series);
    const top = niceTop(Math.max(...columns.map((column) => column.sum), 1e-9) / scale);
    const [first, last] = [times[0], Math.max(times[times.length - 1], times[0] + 1e-3)];
    const x = (time) => MARGIN.left + ((time - first) / (last - first)) * (WIDTH - MARGIN.left - MARGIN.right);
    const y = (value) => HEIGHT - MARGIN.bottom - (value / scale / top) * (HEIGHT - MARGIN.top - MARGIN.bottom);
    const picture = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": label });
    picture.append(...valueAxis(top, unit, (value) => y(value * scale)), ...timeAxis(first, last, x));
    picture.append(...areas(columns, series, x, y));
    const cursor = svg("line", { class: "cursor", y1: MARGIN.top, y2: HEIGHT - MARGIN.bottom, visibility: "hidden" });
    picture.append(cursor);

    const { legend, showAt } = legendOf(series, format);
    const toColumn = (event) => {
        const frame = picture.getBoundingClientRect();
        const time = first + ((((event.clientX - frame.left) / frame.width) * WIDTH - MARGIN.left)
            / (WIDTH - MARGIN.left - MARGIN.right)) * (last - first);
        return columns.reduce((best, column) => Math.abs(column.time - time) < Math.abs(best.time - time) ? column : best);
    };
    picture.addEventListener("pointermove", (event) => {
        const column = toColumn(event);
        cursor.setAttribute("x1", x(column.time));
        cursor.setAttribute("x2", x(column.time));
        cursor.setAttribute("visibility", "visible");
        showAt(column);
    });
    picture.addEventListener("pointerleave", () => {
        cursor.setAttribute("visibility", "hidden");
        showAt(null);
    });
    return element("div", { class: "plot" }, [picture, legend]);
}

/** The values of all series and their sum at each time. */
function columnsOf(times, series) {
    return times.map((time, index) => {
        const values = series.map(({ values: all }) => all[index]);
        return { time, values, sum: values.reduce((sum, value) => sum + value, 0) };
    });
}

/** One area for each series, stacked on those before. */
function areas(columns, series, x, y) {
    const below = columns.map(() => 0);
    return series.map(({ name }, row) => {
        const lower = columns.map((column, index) => `${x(column.time).toFixed(1)},${y(below[index]).toFixed(1)}`);
        columns.forEach((column, index) => { below[index] += column.values[row]; });
        const upper = columns.map((column, index) => `${x(column.time).toFixed(1)},${y(below[index]).toFixed(1)}`);
        const points = [...upper, ...lower.reverse()].join(" ");
        return svg("polygon", { points, fill: SERIES[row % SERIES.length] }, [svg("title", { text: name })]);
    });
}

function valueAxis(top, unit, y) {
    const ticks = [0, 0.25, 0.5, 0.75, 1].map((share) => share * top);
    return ticks.flatMap((value) => [
        svg("line", { class: "grid", x1: MARGIN.left, x2: WIDTH - MARGIN.right, y1: y(value), y2: y(value) }),
        svg("text", {
            class: "tick", x: MARGIN.left - 6, y: y(value) + 4, "text-anchor": "end",
            text: `${Number(value.toPrecision(3))}${value === top ? ` ${unit}` : ""}`,
        }),
    ]);
}

function timeAxis(first, last, x) {
    const step = niceTop((last - first) / 6);
    const count = Math.floor((last - first) / step + 1e-9);
    return Array.from({ length: count + 1 }, (_, index) => svg("text", {
        class: "tick", x: x(first + index * step), y: HEIGHT - 8, "text-anchor": index === 0 ? "start" : "middle",
        text: index === 0 ? seconds(first) : `${Number((first + index * step).toPrecision(4))}`,
    }));
}

/** The next larger of 1, 2, 4, 5, 10, 20 ... */
function niceTop(value) {
    const power = 10 ** Math.floor(Math.log10(Math.max(value, 1e-9)));
    return [1, 2, 4, 5, 10].map((factor) => factor * power).find((nice) => nice >= value * 0.999) ?? 10 * power;
}

/** The legend: names and colours, with the values at the pointer. */
function legendOf(series, format) {
    const when = element("span", { class: "when" });
    const values = series.map(() => element("span", { class: "value" }));
    const items = series.map(({ name }, row) => element("li", {}, [
        element("span", { class: "swatch", style: `background: ${SERIES[row % SERIES.length]}` }),
        element("span", { text: name }),
        values[row],
    ]));
    const showAt = (column) => {
        when.textContent = column ? `at ${seconds(column.time)}: ${format(column.sum)} in all` : "";
        values.forEach((value, row) => { value.textContent = column ? format(column.values[row]) : ""; });
    };
    return { legend: element("div", { class: "legend" }, [element("ul", {}, items), when]), showAt };
}
