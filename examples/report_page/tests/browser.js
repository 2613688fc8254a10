// Starts Chromium without a network and without a graphics card, and compares its pictures.

import { existsSync } from "node:fs";

const PLACES = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
const FLAGS = [
    "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-quic",
];

/** The path of Chromium; undefined when there is none. */
export function findChromium() {
    return PLACES.find((place) => place && existsSync(place));
}

export async function startChromium(executablePath, moreFlags = []) {
    const { chromium } = await import("playwright-core");
    return chromium.launch({ executablePath, args: [...FLAGS, ...moreFlags] });
}

/** Opens a page and records its requests and errors. */
export async function openPage(browser, file, viewport) {
    const context = await browser.newContext({ viewport, offline: true });
    const page = await context.newPage();
    const noted = { requests: [], errors: [] };
    page.on("request", (request) => noted.requests.push(request.url()));
    page.on("console", (message) => {
        if (message.type() === "error") {
            noted.errors.push(message.text());
        }
    });
    page.on("pageerror", (error) => noted.errors.push(error.message));
    await page.goto(`file://${file}`);
    return { page, noted };
}

/** Waits until all changes are drawn. */
export async function drawn(page) {
    await page.waitForFunction(() => window.dymlmReport?.drawn > 0, null, { timeout: 120_000 });
    // A change is drawn in the next animation frame, and a slow one may still be in progress.
    let [before, now] = [-1, 0];
    while (before !== now) {
        before = now;
        await page.waitForTimeout(250);
        now = await page.evaluate(() => window.dymlmReport.drawn);
    }
}

/** The 3D view as PNG. */
export async function viewOf(page) {
    await drawn(page);
    // The pointer is moved away, so that it highlights nothing.
    await page.mouse.move(0, 0);
    return page.locator(".stage").screenshot({ animations: "disabled" });
}

/** Counts the pixels in which two pictures of one size differ, and the red pixels of the second. */
export async function compared(browser, one, other) {
    const page = await browser.newPage();
    try {
        return await page.evaluate(async (pictures) => {
            const pixels = await Promise.all(pictures.map(async (base64) => {
                const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
                const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
                const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
                context.drawImage(bitmap, 0, 0);
                return context.getImageData(0, 0, bitmap.width, bitmap.height).data;
            }));
            const [before, after] = pixels;
            const result = { pixels: after.length / 4, different: 0, red: 0 };
            for (let at = 0; at < after.length; at += 4) {
                const isDifferent = [0, 1, 2].some((channel) => Math.abs(before[at + channel] - after[at + channel]) > 8);
                result.different += isDifferent ? 1 : 0;
                result.red += after[at] > 150 && after[at + 1] < 70 && after[at + 2] < 80 ? 1 : 0;
            }
            return result;
        }, [one, other].map((picture) => picture.toString("base64")));
    } finally {
        await page.close();
    }
}
