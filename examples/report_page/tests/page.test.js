// Clicks through a page that build_map has written: DYMLM_REPORT_PAGE=/path/to/report.html npm test

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { resolve } from "node:path";
import { after, before, describe, test } from "node:test";

import { compared, drawn, findChromium, openPage, startChromium, viewOf } from "./browser.js";
import { readMaps } from "./map_folder.js";

const file = process.env.DYMLM_REPORT_PAGE && resolve(process.env.DYMLM_REPORT_PAGE);
const chromium = findChromium();
const reason = whyNot();
if (reason) {
    console.log(`skipped: ${reason}`);
}

function whyNot() {
    if (!file || !existsSync(file)) {
        return "DYMLM_REPORT_PAGE names no page (build_map --report writes one)";
    }
    return chromium ? undefined : "no Chromium (apt-get install chromium, or CHROMIUM=/path/to/it)";
}

const WIDE = { width: 1280, height: 800 };
/** Text or the outline of a thing changes more pixels than this. */
const CHANGED = 150;

describe("the page of a run", { skip: reason }, () => {
    let browser, page, noted, maps;

    before(async () => {
        maps = readMaps(file);
        browser = await startChromium(chromium);
        ({ page, noted } = await openPage(browser, file, WIDE));
        await drawn(page);
    });
    after(async () => browser?.close());

    const toggle = async (name) => {
        await page.locator(`#show-${name}`).click();
        await drawn(page);
    };
    const changed = async (change) => {
        const earlier = await viewOf(page);
        await change();
        return compared(browser, earlier, await viewOf(page));
    };
    const details = () => page.locator("#details").innerText();
    const choose = async (thing) => {
        const [x, y] = await page.evaluate((wanted) => window.dymlmReport.whereIs(wanted), thing);
        await page.mouse.click(x, y);
        return details();
    };

    test("opens without a network", async () => {
        assert.deepEqual(noted.requests.filter((url) => !/^(blob|data):/.test(url)), [`file://${file}`]);
        assert.deepEqual(noted.errors, []);
        assert.equal(await page.locator("#fault").isVisible(), false);
        const own = await page.content();
        assert.doesNotMatch(own, /\b(src|href)\s*=/);
    });

    test("holds the points of the cloud, each within half a millimetre", async () => {
        const { step, points } = await page.evaluate(() => ({
            step: window.dymlmReport.data.cloud.step,
            points: [...window.dymlmReport.positionsOf("cloud")],
        }));
        assert.equal(points.length, 3 * maps.cloud.length);
        assert.equal(step, 0.001);
        const worst = maps.cloud.reduce((most, point, index) =>
            Math.max(most, ...point.map((value, axis) => Math.abs(value - points[3 * index + axis]))), 0);
        assert.ok(worst <= 0.5 * step + 1e-5, `${worst} m`);
    });

    test("each map can be shown and hidden", async () => {
        for (const name of ["cloud", "octree", "planes", "objects", "trajectory"]) {
            const before = await viewOf(page);
            const change = await changed(() => toggle(name));
            assert.ok(change.different > CHANGED, `${name}: ${JSON.stringify(change)}`);
            await toggle(name);
            const back = await compared(browser, before, await viewOf(page));
            assert.ok(back.different < 20, `${name} and back: ${JSON.stringify(back)}`);
        }
    });

    test("what was removed is shown in red on demand", async () => {
        const count = await page.evaluate(() => window.dymlmReport.data.removed.count);
        assert.equal(await page.locator("#show-removed").isChecked(), false);
        if (count === 0) {
            assert.equal(await page.locator("#show-removed").isDisabled(), true);
            return;
        }
        // The layer is shown alone, so that nothing occludes it, and from above, so that no height does.
        for (const name of ["cloud", "planes", "objects"]) {
            await toggle(name);
        }
        const { red } = await changed(() => toggle("removed"));
        assert.ok(red > Math.min(count, 40), `${red} red pixels of ${count} voxels`);
        for (const name of ["removed", "cloud", "planes", "objects"]) {
            await toggle(name);
        }
    });

    test("a click on a plane tells what it is", async () => {
        await page.locator("[data-view=above]").click();
        // The highest level plane: only things are above it, and they are hidden.
        await toggle("objects");
        const up = await page.evaluate(() => window.dymlmReport.data.up);
        const height = (vector) => vector.reduce((sum, value, axis) => sum + value * up[axis], 0);
        const level = maps.planes.filter((plane) => height(plane.normal) > 0.97 && plane.area_m2 > 0.15);
        assert.ok(level.length > 0);
        const plane = level.reduce((best, other) => height(other.centroid) > height(best.centroid) ? other : best);
        const text = await choose({ kind: "plane", id: plane.id });
        assert.match(text, new RegExp(`^Plane ${plane.id}\\b`));
        assert.match(text, /level, seen from above/);
        const area = Number(/([\d.]+) m²/.exec(text)[1]);
        const seenBy = Number(/([\d,]+) key frames/.exec(text)[1].replace(",", ""));
        // planes.json has the area within the boundary, the page the area of the cells that were read.
        assert.ok(Math.abs(area - plane.area_m2) < 0.15 * plane.area_m2, `${area}, ${plane.area_m2} m²`);
        assert.equal(seenBy, plane.observations);
        assert.match(text, /first, last seen\s+[−\d.]+ s, [\d.]+ s/);
        await toggle("objects");
    });

    test("a click on an object tells its label, size and history", async () => {
        // Planes are hidden, since one may occlude it.
        await toggle("planes");
        const places = await page.evaluate((ids) =>
            ids.map((id) => window.dymlmReport.whereIs({ kind: "object", id })), maps.objects.map(({ id }) => id));
        // The object farthest from all others, so that no other label overlaps it.
        const room = places.map((place, index) => Math.min(...places.map((other, at) =>
            at === index ? Infinity : Math.hypot(place[0] - other[0], place[1] - other[1]))));
        const object = maps.objects[room.indexOf(Math.max(...room))];
        const text = await choose({ kind: "object", id: object.id });
        assert.match(text, new RegExp(`^${object.label} ${object.id}\\b`));
        const size = object.dimensions.map((length) => length.toFixed(2)).join(" × ");
        assert.ok(text.includes(`${size} m`) && text.includes(`, ${object.shape}`), text);
        assert.match(text, new RegExp(`detections\\s+${object.observations} in \\d+ frames in view`));
        assert.match(text, /History[^]*seen for the first time[^]*confirmed/);
        assert.equal(await page.locator(`[data-thing=object-${object.id}]`).getAttribute("aria-pressed"), "true");
        // A click on the background clears the choice.
        const stage = await page.locator(".stage").boundingBox();
        await page.mouse.click(stage.x + stage.width - 5, stage.y + stage.height - 5);
        assert.match(await details(), /Click a plane or an object/);
        await toggle("planes");
    });

    test("the slider hides what is above", async () => {
        await page.locator("[data-view=oblique]").click();
        const slider = await page.locator("#cut").boundingBox();
        const middle = slider.y + slider.height / 2;
        const text = () => page.locator("#cut-height").innerText();
        const [start, uncut] = [await text(), await viewOf(page)];
        const { x: left, width } = slider;
        const value = await page.locator("#cut").evaluate((input) => (input.value - input.min) / (input.max - input.min));
        await page.mouse.move(left + 8 + value * (width - 16), middle);
        await page.mouse.down();
        await page.mouse.move(left + 0.4 * width, middle, { steps: 4 });
        await page.mouse.up();
        const halfway = await compared(browser, uncut, await viewOf(page));
        assert.notEqual(await text(), start);
        assert.ok(halfway.different > CHANGED, JSON.stringify(halfway));
        await page.locator("#cut").press("Home");
        const emptied = await compared(browser, uncut, await viewOf(page));
        assert.ok(emptied.different > halfway.different, JSON.stringify({ halfway, emptied }));
        await page.locator("#cut").press("End");
        assert.equal(await text(), "nothing");
    });

    test("all of it works from the keyboard", async () => {
        await page.locator("#show-octree").focus();
        const { different } = await changed(() => page.keyboard.press("Space"));
        assert.ok(different > CHANGED);
        await page.keyboard.press("Space");
        await page.locator("#lists summary").first().focus();
        await page.keyboard.press("Enter");
        await page.keyboard.press("Tab");
        await page.keyboard.press("Enter");
        assert.match(await details(), /^Plane \d+/);
        await page.locator("#view").focus();
        await page.keyboard.press("Escape");
        assert.match(await details(), /Click a plane or an object/);
        const moved = await changed(async () => {
            await page.locator("#view").focus();
            await page.keyboard.press("ArrowLeft");
        });
        assert.ok(moved.different > CHANGED);
    });

    test("plots and tables tell of the run", async () => {
        const rows = await page.locator("#counts").innerText();
        const { counts, key_frames: keyFrames, stages } = maps.report;
        for (const [name, value] of [["planes", counts.planes], ["objects", counts.objects], ["key frames", keyFrames]]) {
            assert.match(rows, new RegExp(`${name}\\s+${value.toLocaleString("en")}\\b`));
        }
        assert.match(await page.locator("#times").innerText(), /dynamics[^]*all of a key frame/);
        assert.ok(stages.insert.median_ms > 0);
        const drawnSteps = await page.locator("#stage-plot polygon").count();
        assert.ok(drawnSteps >= 6, `${drawnSteps}`);
        assert.ok(await page.locator("#memory-plot polygon").count() >= 4);
        await page.locator("#stage-plot svg").hover();
        assert.match(await page.locator("#stage-plot .when").innerText(), /at [\d.]+ s: [\d.]+ ms in all/);
    });

    test("fits a narrow screen", async () => {
        await page.setViewportSize({ width: 390, height: 800 });
        await drawn(page);
        const width = await page.evaluate(() => document.scrollingElement.scrollWidth);
        assert.ok(width <= 390, `${width}`);
        const canvas = await page.locator("#view").boundingBox();
        assert.ok(canvas.width > 350 && canvas.height > 300, JSON.stringify(canvas));
        await page.setViewportSize(WIDE);
    });

    test("nothing was asked for or complained of on the way", () => {
        assert.deepEqual(noted.requests.filter((url) => !/^(blob|data):/.test(url)), [`file://${file}`]);
        assert.deepEqual(noted.errors, []);
    });
});

describe("a browser without WebGL", { skip: reason }, () => {
    test("shows plots and tables, and says what is missing", async () => {
        const browser = await startChromium(chromium, ["--disable-3d-apis"]);
        try {
            const { page } = await openPage(browser, file, WIDE);
            await page.locator("#fault").waitFor({ state: "visible" });
            assert.match(await page.locator("#fault").innerText(), /cannot be shown/);
            assert.ok(await page.locator("#stage-plot polygon").count() > 0);
        } finally {
            await browser.close();
        }
    });
});
