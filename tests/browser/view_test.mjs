// bsp2 view as a person uses it: node view_test.mjs PROGRAM BROWSER [use|detail]
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdtemp, mkdir, rename, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const [program, executablePath, wanted] = process.argv.slice(2);
const seed = Number(process.env.BSP2_SEED ?? Math.floor(Math.random() * 2 ** 31));
console.log(`BSP2_SEED=${seed}`);
let state = seed;
const random = () => { state = (Math.imul(state, 1103515245) + 12345) & 0x7fffffff; return state / 0x80000000; };
const shots = process.env.BSP2_SCREENSHOTS;
if (shots) await mkdir(shots, { recursive: true });
const patience = 60000; // of each wait: machines may be busy
const folder = await mkdtemp(join(tmpdir(), 'bsp2-view-'));
const children = new Set();

/** A model whose figures are known: a hollow box and a plate beside it, in two parts. */
const box = (height) => `part("box") { difference() { multmatrix([[1,0,0,-5],[0,1,0,-5],[0,0,1,0],[0,0,0,1]]) { cube(size = [10, 10, ${height}]); }
  multmatrix([[1,0,0,-3],[0,1,0,-3],[0,0,1,2],[0,0,0,1]]) { cube(size = [6, 6, ${height - 4}]); } } }
part("plate") { multmatrix([[1,0,0,8],[0,1,0,-5],[0,0,1,0],[0,0,0,1]]) { cube(size = [4, 10, 1]); } }\n`;

async function view(file, ...options) {
  const child = spawn(program, ['view', file, ...options], { stdio: ['ignore', 'pipe', 'pipe'] });
  children.add(child);
  let said = '';
  child.stderr.on('data', (data) => { said += data; });
  const ended = new Promise((done) => child.on('exit', (code, signal) => { children.delete(child); done(code ?? signal); }));
  const link = await new Promise((done, fail) => {
    let text = '';
    child.stdout.on('data', (data) => { text += data; const found = text.match(/http:\S+/); if (found) done(found[0]); });
    ended.then(() => fail(new Error(`bsp2 view ended: ${said}`)));
  });
  return { child, ended, link, said: () => said };
}

const browser = await chromium.launch({ executablePath, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'] });

async function open(link, options = {}) {
  const context = await browser.newContext({ viewport: { width: 800, height: 560 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(patience);
  page.faults = [];
  page.on('pageerror', (error) => page.faults.push(error.stack));
  page.on('console', (said) => { if (said.type() === 'error' && !/WebSocket|ERR_CONNECTION/.test(said.text())) page.faults.push(said.text()); });
  page.on('request', (request) => { if (new URL(request.url()).origin !== new URL(link).origin && !request.url().startsWith('data:')) page.faults.push(`asks ${request.url()}`); });
  await page.goto(link);
  return page;
}
const until = (page, test, argument) => page.waitForFunction(test, argument, { timeout: patience, polling: 50 });
const finished = (page) => until(page, () => window.bsp2?.progress.state === 'finished' && bsp2.stage.hasSurface);
const satisfied = (page) => until(page, () => bsp2.isSatisfied);
const shot = async (page, name) => { if (shots) { await page.waitForTimeout(600); await page.screenshot({ path: join(shots, `${name}.png`) }); } };

/** Draws now: how many pixels are covered, and the box around them. */
const covered = (page) => page.evaluate(() => {
  const { stage } = bsp2;
  stage.draw();
  const gl = stage.renderer.getContext();
  const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const pixels = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let count = 0, left = w, right = 0, sum = [0, 0, 0];
  for (let i = 0; i < w * h; ++i) {
    if (pixels[4 * i + 3] === 0) continue;
    count += 1;
    left = Math.min(left, i % w);
    right = Math.max(right, i % w);
    for (let c = 0; c < 3; ++c) sum[c] += pixels[4 * i + c];
  }
  return { count, width: right - left, mean: sum.map((x) => x / count), all: w * h };
});

/** A process that rests most of the time. @returns what lets it go on as usual. */
function slowed(child) {
  let isSlow = true;
  const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));
  const resting = (async () => {
    while (isSlow) {
      child.kill('SIGSTOP');
      await pause(80);
      child.kill('SIGCONT');
      await pause(20);
    }
  })();
  return () => { isSlow = false; return resting; };
}

async function step(name, work) {
  const start = Date.now();
  await work();
  console.log(`ok - ${name} (${((Date.now() - start) / 1000).toFixed(1)} s)`);
}

/** What one does with a page of a model. */
async function use() {
  const file = join(folder, 'model.csg');
  await writeFile(file, box(10));
  const run = await view(file);
  const page = await open(run.link);

  await step('the first picture, and the surface in its place', async () => {
    await until(page, () => window.bsp2?.stats.firstPicture > 0);
    await finished(page);
    const { count, all } = await covered(page);
    assert.ok(count > 0.05 * all && count < 0.9 * all, `${count} of ${all} pixels`);
    const text = await page.textContent('#facts');
    assert.ok(text.includes('volume824'), text); // 1000 - 216 + 40
    assert.ok(text.includes('surface area924'), text); // 600 + 216 + 108
    await shot(page, 'first');
  });

  await step('parts are listed, hidden, shown alone', async () => {
    assert.deepEqual(await page.locator('#parts .what').allTextContents(), ['box', 'plate']);
    const before = await covered(page);
    await page.click('#parts li:nth-child(1) button');
    const plate = await covered(page);
    assert.ok(plate.count > 0 && plate.count < 0.6 * before.count, `${plate.count} of ${before.count}`);
    await page.dblclick('#parts li:nth-child(1) .what');
    const alone = await covered(page);
    assert.ok(alone.count > plate.count && alone.count < before.count);
    await page.click('#showall');
    assert.equal((await covered(page)).count, before.count);
    await page.keyboard.press('Escape');
  });

  await step('sections are filled where the solid is', async () => {
    await page.click('#views');
    await page.click('#viewlist button:has-text("Parallel")');
    await page.keyboard.press('2'); // from the front
    await page.locator('#clips .clip:nth-child(2) input[type=number]').fill('1');
    await page.keyboard.press('Enter');
    const planes = () => page.evaluate(() => bsp2.stage.planes.map(({ normal, constant }) => [...normal.toArray(), Math.round(constant * 100) / 100]));
    assert.deepEqual(await planes(), [[0, 1, 0, -1]]);
    await page.click('#clips .clip:nth-child(2) button');
    assert.deepEqual(await planes(), [[0, -1, 0, 1]]);
    await page.click('#clips .clip:nth-child(2) button');
    await shot(page, 'section');
    // What is under random places, against the figures of the model.
    const places = Array.from({ length: 60 }, () => [random() * 16 - 5, random() * 10]);
    await covered(page);
    const found = await page.evaluate((asked) => asked.map(([x, z]) => {
      const { stage } = bsp2;
      const at = stage.controls.target.clone().set(x, 1, z).project(stage.camera);
      return stage.pick(at.x, at.y)?.kind ?? 'nothing';
    }), places);
    let sections = 0;
    places.forEach(([x, z], i) => {
      const near = [-5, -3, 3, 5, 8, 12].some((edge) => Math.abs(x - edge) < 0.05) || [0, 1, 2, 8, 10].some((edge) => Math.abs(z - edge) < 0.05);
      if (near) return;
      const hollow = Math.abs(x) < 3 && z > 2 && z < 8;
      const expected = Math.abs(x) < 5 ? (hollow ? 'face' : 'section') : x > 8 && z < 1 ? 'section' : 'nothing';
      assert.equal(found[i], expected, `at ${x}, ${z}`);
      sections += expected === 'section';
    });
    assert.ok(sections > 5);
    // And filled: seen from the front, the caps hide what is behind, which shading would show darker.
    const filled = await page.evaluate(() => {
      const { stage } = bsp2;
      const gl = stage.renderer.getContext();
      stage.draw();
      const at = stage.controls.target.clone().set(-4, 0, 5).project(stage.camera);
      const read = new Uint8Array(4 * 64);
      gl.readPixels(Math.round((at.x + 1) / 2 * gl.drawingBufferWidth) - 4, Math.round((at.y + 1) / 2 * gl.drawingBufferHeight) - 4, 8, 8, gl.RGBA, gl.UNSIGNED_BYTE, read);
      return [...read].filter((_, i) => i % 4 === 3).every((a) => a === 255);
    });
    assert.ok(filled);
    await page.click('#clip-y');
    await page.keyboard.press('p');
  });

  await step('faces are picked, and measured between', async () => {
    await page.keyboard.press('2');
    const spot = (x, y, z) => page.evaluate((p) => {
      const { stage } = bsp2;
      stage.draw();
      const at = stage.controls.target.clone().set(...p).project(stage.camera);
      const { left, top, width, height } = stage.canvas.getBoundingClientRect();
      return [left + (at.x + 1) / 2 * width, top + (1 - at.y) / 2 * height];
    }, [x, y, z]);
    await page.mouse.click(...await spot(-1, -5, 2));
    const one = await page.textContent('#picked');
    assert.match(one, /partbox/);
    assert.match(one, /face area100/);
    assert.match(one, /part volume784/);
    await page.keyboard.down('Shift');
    await page.mouse.click(...await spot(-1, -5, 7));
    await page.keyboard.up('Shift');
    const both = await page.textContent('#picked');
    const distance = Number(both.match(/distance([\d.]+)/)[1]);
    assert.ok(Math.abs(distance - 5) < 0.1, both);
    assert.match(both, /angle of normals0\.00°/);
    await shot(page, 'measure');
    await page.keyboard.press('Escape');
    await page.click('#parts li:nth-child(2) .what');
    assert.match(await page.textContent('#picked'), /plate.*volume40.*area108/);
    await page.keyboard.press('Escape');
  });

  await step('explode moves parts apart, shades change colours', async () => {
    const before = await covered(page);
    await page.locator('#explode').fill('1');
    const apart = await covered(page);
    assert.ok(apart.width > 1.2 * before.width, `${apart.width} of ${before.width}`);
    await page.locator('#explode').fill('0');
    await page.selectOption('#shade', 'part');
    const parts = await covered(page);
    assert.ok(Math.abs(parts.mean[0] - before.mean[0]) > 5, `${parts.mean}, ${before.mean}`);
    await page.selectOption('#shade', 'region');
    await satisfied(page);
    assert.ok((await covered(page)).count > 0.8 * before.count);
    await page.selectOption('#shade', 'colour');
  });

  await step('the address remembers what is seen', async () => {
    await page.click('#parts li:nth-child(2) button');
    await page.click('#clip-z');
    await page.keyboard.press('1');
    await until(page, () => location.hash.includes('hide=1') && location.hash.includes('z=0.5'));
    await page.waitForTimeout(400);
    const [before, address] = [await covered(page), page.url()];
    const other = await open(address);
    await finished(other);
    const after = await covered(other);
    assert.ok(Math.abs(after.count - before.count) < 0.01 * before.count, `${after.count}, ${before.count}`);
    assert.equal(await other.evaluate(() => bsp2.progress.state), 'finished');
    assert.deepEqual(other.faults, []);
    await other.context().close();
    const odd = await open(`${page.url().split('#')[0]}#eye=1e308,0,0&at=0,0,0&hide=a.0.5&z=9e9&explode=-5&shade=none`);
    await finished(odd);
    await satisfied(odd);
    assert.ok((await covered(odd)).count > 0, 'an address that makes no sense');
    assert.deepEqual(odd.faults, []);
    await odd.context().close();
    await page.click('#clip-z');
    await page.click('#showall');
  });

  await step('a model that is saved is evaluated again, and the camera stays', async () => {
    await page.keyboard.press('3');
    await page.waitForTimeout(300);
    const camera = () => page.evaluate(() => bsp2.stage.camera.position.toArray().join());
    const before = await camera();
    await writeFile(join(folder, 'new'), box(20));
    await rename(join(folder, 'new'), file);
    await until(page, () => document.getElementById('facts').textContent.includes('volume1,464')); // 2000 - 576 + 40
    assert.equal(await camera(), before);
  });

  await step('mistakes are shown with their place, and go', async () => {
    await writeFile(file, 'cube(size = 1);\nnonsense(3);\n');
    // Not at once: for a moment the file is empty, which is a mistake, too.
    await until(page, () => /model\.csg:2/.test(document.querySelector('#error:not([hidden])')?.textContent));
    assert.equal(await page.textContent('#state'), 'failed');
    assert.ok((await covered(page)).count > 0, 'what was there stays');
    await shot(page, 'mistake');
    await writeFile(file, box(12));
    await page.waitForSelector('#error', { state: 'hidden' });
    await until(page, () => document.getElementById('facts').textContent.includes('volume952')); // 1200 - 288 + 40
    assert.match(run.said(), /model\.csg:2/);
  });

  await step('on a phone in the dark', async () => {
    const phone = await open(run.link, { viewport: { width: 390, height: 780 }, colorScheme: 'dark', hasTouch: true, isMobile: true });
    await finished(phone);
    assert.equal(await phone.evaluate(() => document.documentElement.scrollWidth), 390);
    assert.equal(await phone.evaluate(() => document.documentElement.dataset.theme), 'dark');
    await shot(phone, 'phone');
    await phone.tap('#menu');
    await shot(phone, 'phone-panel');
    assert.deepEqual(phone.faults, []);
    await phone.context().close();
  });

  await step('the command ends with the last page', async () => {
    assert.deepEqual(page.faults, []);
    await page.context().close();
    assert.equal(await run.ended, 0);
  });
}

/** How much of a solid a page gets, and when. */
async function detail() {
  let page;
  await step('many regions are drawn in blocks, and look as they do by themselves', async () => {
    const cubes = join(folder, 'cubes.csg');
    await writeFile(cubes, Array.from({ length: 1000 }, (_, i) => `multmatrix([[1,0,0,${2 * (i % 10)}],[0,1,0,${2 * (Math.floor(i / 10) % 10)}],[0,0,1,${2 * Math.floor(i / 100)}],[0,0,0,1]]) cube(1);`).join('\n'));
    const many = await view(cubes, '--regions', '200');
    page = await open(many.link);
    await finished(page);
    await page.keyboard.press('c');
    await satisfied(page);
    const regions = await page.evaluate(() => bsp2.stage.regions.size);
    assert.ok(regions > 64, `${regions} regions`);
    const calls = () => page.evaluate(() => { bsp2.stage.draw(); return bsp2.stats.calls; });
    await until(page, (most) => { bsp2.stage.draw(); return bsp2.stats.calls < most; }, regions / 8);
    const together = await covered(page);
    await shot(page, 'blocks');
    const middle = await page.evaluate(() => bsp2.stage.pick(0, 0)?.kind ?? 'nothing');
    await page.keyboard.press('t'); // nets are drawn by themselves
    assert.ok(await calls() >= regions);
    await page.keyboard.press('t');
    const alone = await page.evaluate(() => {
      for (const block of bsp2.stage.blocks.blocks.values()) { bsp2.stage.blocks.divide(block); block.since = Infinity; }
      return bsp2.stage.pick(0, 0)?.kind ?? 'nothing';
    });
    const apart = await covered(page);
    assert.ok(await calls() >= regions / 2, 'each by itself');
    assert.equal(alone, middle);
    assert.equal(apart.count, together.count);
    for (const c of [0, 1, 2]) assert.ok(Math.abs(apart.mean[c] - together.mean[c]) < 1, `${apart.mean}, ${together.mean}`);
    assert.deepEqual(page.faults, []);
    await page.context().close();
    assert.equal(await many.ended, 0);
  });

  await step('what was undecided is gone where nothing is left', async () => {
    const half = join(folder, 'half.csg');
    const balls = Array.from({ length: 256 }, (_, i) => `multmatrix([[1,0,0,${i % 8}],[0,1,0,${Math.floor(i / 8) % 8}],[0,0,1,${Math.floor(i / 64)}],[0,0,0,1]]) sphere(r = 1.2, $fn = 12);`);
    await writeFile(half, `difference() { cube(size = [16, 8, 8]);\n${balls.join('\n')}\n}\n`);
    const run = await view(half, '--regions', '200', '--budget', '30ms', '--order', 'priority', '--threads', '1');
    page = await open(run.link);
    await finished(page);
    await page.keyboard.press('c');
    await satisfied(page);
    assert.ok(await page.evaluate(() => bsp2.stage.regions.size) > 0);
    assert.equal(await page.evaluate(() => [...bsp2.stage.regions.values()].filter((region) => region.fuzzy).length), 0);
    await page.context().close();
    assert.equal(await run.ended, 0);
  });

  await step('what is far away is coarse, and fine where the page comes near', async () => {
    const plate = join(folder, 'plate.csg'); // 900 small balls; in one corner a large one
    const balls = Array.from({ length: 900 }, (_, i) => `multmatrix([[1,0,0,${10 * (i % 30)}],[0,1,0,${10 * Math.floor(i / 30)}],[0,0,1,0],[0,0,0,1]]) sphere(r = ${i === 0 ? 4 : 0.6}, $fn = 16);`);
    await writeFile(plate, balls.join('\n'));
    const run = await view(plate);
    page = await open(run.link);
    await finished(page);
    await satisfied(page);
    const state = () => page.evaluate(() => {
      const { stage } = bsp2;
      const pieces = [...stage.pieces.values()];
      const pixel = (item) => { // the least that a pixel is anywhere in the box of a piece
        const [lower, upper] = item.message.box;
        const depths = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => -stage.controls.target.clone().set(...[0, 1, 2].map((k) => ((i >> k) & 1 ? upper : lower)[k])).applyMatrix4(stage.camera.matrixWorldInverse).z);
        return 2 * Math.min(...depths) * Math.tan(stage.camera.fov * Math.PI / 360) / stage.renderer.domElement.height;
      };
      return { triangles: pieces.reduce((sum, item) => sum + item.message.arrays.triangles.length / 3, 0), bytes: bsp2.stats.bytes,
        steps: pieces.map((item) => item.message.step), coarsest: Math.max(...pieces.map((item) => item.message.step / pixel(item))) };
    });
    const far = await state();
    await shot(page, 'far');
    const all = 900 * 16 * 14;
    assert.ok(far.triangles < 0.7 * all, `${far.triangles} of ${all} triangles`);
    assert.ok(far.coarsest <= 0.5 * 1.0001, `${far.coarsest} pixels`);
    // Picked: what is told is exact, also where it is drawn coarsely.
    const spot = await page.evaluate(() => {
      const { stage } = bsp2;
      const at = stage.controls.target.clone().set(0, 0, 3.9).project(stage.camera);
      const { left, top, width, height } = stage.canvas.getBoundingClientRect();
      return [left + (at.x + 1) / 2 * width, top + (1 - at.y) / 2 * height];
    });
    await page.mouse.click(...spot);
    await until(page, () => bsp2.picks[0]?.item.message.step === 2 ** bsp2.picks[0]?.item.message.finest);
    const picked = await page.evaluate(() => bsp2.picks.map(({ area, solidVolume, triangles }) => ({ area, solidVolume, triangles: triangles.length })));
    assert.ok(picked.length === 1 && picked[0].triangles > 0);
    assert.ok(picked[0].solidVolume > 200 && picked[0].area > 0.1, JSON.stringify(picked)); // a ball of radius 4 has 268
    await page.keyboard.press('Escape');
    // Near a corner: finer there, and what is outside is as it was.
    await page.evaluate(() => { const { stage } = bsp2; stage.controls.target.set(0, 0, 0); stage.camera.position.set(15, -25, 20); stage.controls.update(); stage.invalidate(); });
    await satisfied(page);
    const near = await state();
    await shot(page, 'near');
    assert.ok(near.triangles > far.triangles, `${near.triangles}, ${far.triangles}`);
    assert.ok(Math.min(...near.steps) < Math.min(...far.steps));
    assert.deepEqual(page.faults, []);
    await page.context().close();
    assert.equal(await run.ended, 0);
  });

}

/** What is cut, exploded or hidden. */
async function sections() {
  let page;
  await step('sections, what is exploded and what is hidden hold no more than the window shows', async () => {
    const crowd = join(folder, 'crowd.csg'); // 2,000 small cubes about a block: two parts, in boxes that overlap
    const moved = (x, y, z, solid) => `multmatrix([[1,0,0,${x}],[0,1,0,${y}],[0,0,1,${z}],[0,0,0,1]]) ${solid}`;
    const cubes = Array.from({ length: 2000 }, (_, i) => moved(8 * (i % 20) - 80, 8 * (Math.floor(i / 20) % 20) - 80, 8 * Math.floor(i / 400) - 16, 'cube(2);'));
    await writeFile(crowd, `part("crowd") { difference() { union() { ${cubes.join('\n')} }\n${moved(-20, -20, -40, 'cube([40, 40, 80]);')} } }\npart("block") ${moved(-10, -10, -30, 'cube([20, 20, 60]);')}\n`);
    const run = await view(crowd);
    page = await open(run.link);
    await finished(page);
    await page.click('#views');
    await page.click('#viewlist button:has-text("Parallel")');
    await page.keyboard.press('6'); // from above
    await page.evaluate(() => bsp2.stage.zoom(1 / 6));
    const bounded = async (what) => {
      await satisfied(page);
      const found = await page.evaluate(() => {
        const { stage } = bsp2;
        const all = [];
        for (const map of [stage.pieces, stage.regions]) for (const item of map.values()) {
          const [lower, upper] = item.message.box, offset = stage.offsetOf(item).toArray();
          const seen = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => stage.controls.target.clone().set(...[0, 1, 2].map((k) => ((i >> k) & 1 ? upper : lower)[k] + offset[k])).project(stage.camera));
          const extent = (axis, pixels) => Math.max(1, (Math.max(...seen.map((p) => p[axis])) - Math.min(...seen.map((p) => p[axis]))) / 2 * pixels);
          const { width, height } = stage.renderer.domElement;
          all.push({ triangles: item.message.arrays.triangles.length / 3, most: Math.max(24, 2 * extent('x', width) * extent('y', height)), voxels: Boolean(item.message.voxels) });
        }
        return all;
      });
      for (const { triangles, most } of found) assert.ok(triangles <= 1.05 * most + 24, `${what}: ${triangles} triangles where ${most} are enough`);
      return found.filter(({ voxels, triangles }) => voxels && triangles > 0).length;
    };
    /** What a section is filled with: its area, and the parts that it is of. */
    const filled = () => page.evaluate(() => {
      const mesh = bsp2.stage.fillingOf(2);
      if (!mesh) return null;
      const { position } = mesh.geometry.attributes, { index } = mesh.geometry;
      const p = (i) => bsp2.stage.controls.target.clone().fromBufferAttribute(position, index.getX(i));
      let area = 0;
      for (let i = 0; i < index.count; i += 3) area += p(i + 1).sub(p(i)).cross(p(i + 2).sub(p(i))).length() / 2;
      return { area, parts: [...new Set(mesh.userData.parts)].sort() };
    });
    assert.ok(await bounded('as it is') > 0, 'voxels');
    await page.locator('#clips .clip:nth-child(3) input[type=number]').fill('1');
    await page.keyboard.press('Enter');
    await page.focus('#canvas'); // what is below stays, and is seen from above
    assert.ok(await bounded('cut') > 0, 'voxels');
    const middle = Array.from({ length: 20 }, (_, i) => 8 * i - 80).filter((x) => x > -22 && x < 20); // columns that the hole is cut out of
    const cover = (x) => Math.max(0, Math.min(x + 2, 20) - Math.max(x, -20));
    const holes = middle.reduce((sum, x) => sum + cover(x), 0) ** 2;
    const section = await filled();
    assert.ok(section, 'bsp2 has told');
    assert.deepEqual(section.parts, [0, 1]);
    assert.ok(Math.abs(section.area - (400 * 4 - holes + 400)) < 20, `${section.area}, ${400 * 4 - holes + 400}`);
    await shot(page, 'crowd-cut');
    const kind = (x, y) => page.evaluate(([a, b]) => { const { stage } = bsp2; const at = stage.controls.target.clone().set(a, b, 1).project(stage.camera); return stage.pick(at.x, at.y); }, [x, y]).then((picked) => picked && `${picked.kind} ${picked.part}`);
    for (let i = 0; i < 20; ++i) assert.equal(await kind(18 * random() - 9, 18 * random() - 9), 'section 1');
    assert.equal(await kind(15, 15), null);
    await page.click('#parts li:nth-child(1) button');
    await bounded('cut, and a part hidden');
    assert.deepEqual((await filled()).parts, [1]);
    await page.keyboard.press('c');
    assert.ok(await page.evaluate(() => bsp2.stage.wantsSurface === false));
    await until(page, () => bsp2.isSatisfied && !bsp2.stage.showsSurface);
    await bounded('cells, cut, a part hidden');
    const cells = await filled();
    assert.deepEqual(cells.parts, [1]);
    assert.ok(Math.abs(cells.area - 400) < 5, `${cells.area}`);
    assert.equal(await page.evaluate(() => [...bsp2.stage.regions.values()].some(({ message }) => message.arrays.parts.includes(0))), false, 'hidden cells are not sent');
    await shot(page, 'cells-cut-hidden');
    await page.click('#showall');
    await until(page, () => bsp2.isSatisfied && [...bsp2.stage.regions.values()].some(({ message }) => message.arrays.parts.includes(0)));
    assert.deepEqual((await filled()).parts, [0, 1]);
    await page.keyboard.press('c');
    await page.locator('#explode').fill('1');
    assert.ok(await bounded('cut and exploded') > 0, 'voxels');
    assert.ok((await filled()).parts.includes(1));
    await shot(page, 'crowd-exploded');
    assert.deepEqual(page.faults, []);
    await page.context().close();
    assert.equal(await run.ended, 0);
  });

}

/** A run that goes on while pages come and go. */
async function long_run() {
  const large = join(folder, 'large.csg');
  const many = Array.from({ length: 2000 }, () => `multmatrix([[0.8,-0.6,0,${random() * 60}],[0.6,0.8,0,${random() * 60}],[0,0,1,${random() * 60}],[0,0,0,1]]) { sphere($fn = 24, r = ${2 + 6 * random()}); }`);
  await writeFile(large, `union() {\n${many.join('\n')}\n}\n`);
  const long = await view(large, '--threads', '1');
  const goOn = slowed(long.child); // until a page has seen it: however busy the machine is, that takes less than the run
  const page = await open(long.link, { viewport: { width: 420, height: 300 } });

  await step('a page that is loaded again while the run goes on, and two at once', async () => {
    await until(page, () => window.bsp2?.stats.firstPicture > 0 && bsp2.stage.isPlaced);
    assert.equal(await page.evaluate(() => bsp2.progress.state), 'running', 'the run is too short for this test');
    await goOn();
    await shot(page, 'running');
    await page.reload();
    const other = await open(long.link, { viewport: { width: 420, height: 300 } });
    for (const each of [page, other]) await until(each, () => window.bsp2?.stats.firstPicture > 0 && bsp2.stage.regions.size + bsp2.stage.pieces.size > 0);
    assert.equal(long.child.exitCode, null);
    await other.context().close();
  });

  await step('a server that is killed', async () => {
    long.child.kill('SIGKILL');
    await long.ended;
    await until(page, () => /connecting|ended/.test(document.getElementById('state').textContent));
    assert.ok((await covered(page)).count > 0, 'what was there stays');
    await page.context().close();
  });
}

const parts = { use, detail, sections, long_run };
let failed = 0;
try {
  for (const part of wanted ? [wanted] : Object.keys(parts)) await parts[part]();
} catch (error) {
  failed = 1;
  console.log(`not ok - ${error.stack}`);
} finally {
  for (const child of children) child.kill('SIGKILL');
  await browser.close();
  await rm(folder, { recursive: true, force: true });
}
process.exit(failed);
