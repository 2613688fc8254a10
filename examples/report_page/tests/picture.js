// Draws docs/pictures/report.png: DYMLM_REPORT_PAGE=/path/to/report.html npm run picture, of a synthetic sequence.

import { findChromium, openPage, startChromium, drawn } from "./browser.js";

const browser = await startChromium(findChromium());
const { page } = await openPage(browser, process.env.DYMLM_REPORT_PAGE, { width: 1010, height: 860 });
await drawn(page);
// The nearest chair is chosen.
const chairs = await page.evaluate(() => window.dymlmReport.data.objects
    .filter(({ label }) => label === "chair")
    .map(({ id }) => window.dymlmReport.whereIs({ kind: "object", id })));
const [x, y] = chairs.reduce((lowest, place) => (place[1] > lowest[1] ? place : lowest));
await page.mouse.click(x, y);
await page.mouse.move(0, 0);
await drawn(page);
await page.screenshot({ path: new URL("../../../docs/pictures/report.png", import.meta.url).pathname });
await browser.close();
