// Reports in a real browser: node browser.js ODYN REPO [FOLDER FOR PICTURES]
//
// Checks that nothing is asked of a network, that nothing is complained of in the console, that what is drawn and listed is what
// the files of the run say, and that people who use a keyboard or a screen reader can use the page.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, statSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { accessible, browser, odyn, picture, pictures, repository, work } from "./common.js";

function run(scene, name, ...more) {
  const folder = join(work, name);
  execFileSync(odyn, ["run", scene, "--quiet", "--report", "-o", folder, ...more], { cwd: repository, stdio: ["ignore", "ignore", "inherit"] });
  return folder;
}

/** Opens a page; whatever it asks for besides itself, and whatever it complains of, is kept. */
async function open(file, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1200, height: 900 }, reducedMotion: "reduce", ...options });
  const page = await context.newPage();
  const faults = [];
  page.on("request", (request) => /^(file|blob|data):/.test(request.url()) || faults.push(`request ${request.url()}`));
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  page.on("pageerror", (error) => faults.push(String(error)));
  const started = Date.now();
  await page.goto(pathToFileURL(file).href);
  await page.waitForSelector("html[data-ready=yes]", { timeout: 20000 });
  return { page, context, faults, ready: Date.now() - started };
}

function table(folder) {
  const lines = readFileSync(join(folder, "results.csv"), "utf8").trim().split("\n");
  const names = lines[0].split(",");
  return { names, rows: lines.slice(1).map((line) => line.split(",").map(Number)) };
}

async function compressor() {
  const folder = run("scenes/compressor.toml", "compressor");
  const { page, context, faults, ready } = await open(join(folder, "report.html"));
  const { names, rows } = table(folder);

  const plotted = await page.evaluate(() => {
    const [run] = window.odyn.runs;
    return { names: run.channels.map(({ name }) => name), times: [...run.times], columns: run.channels.map(({ values }) => [...values]) };
  });
  assert.deepEqual(["t", ...plotted.names], names);
  rows.forEach((row, k) => {
    assert.equal(plotted.times[k], row[0]);
    plotted.columns.forEach((column, c) => assert.equal(column[k], row[c + 1], `${names[c + 1]}, row ${k}`));
  });
  const drawn = await page.evaluate(() => window.odyn.charts.flatMap((chart) => chart.series.slice(1).map((s, k) => [s.label, [...chart.data[k + 1]]])));
  for (const [label, values] of drawn) {
    const column = names.indexOf(label.replace(" (not unique)", ""));
    assert.ok(column > 0, label);
    values.forEach((value, k) => assert.equal(value, rows[k][column]));
  }

  // Three points at three times: where their poses put them, and where something is drawn.
  const points = [
    ["rotor", [0.0085, 0, 0.006]],
    ["piston", [0.02, 0, 0]],
    ["conrod", [0, 0, 0]],
  ];
  for (const t of [0, 37.25, 150]) {
    for (const [name, r] of points) {
      const [found, expected] = await page.evaluate(
        ([name, r, t]) => {
          const { view } = window.odyn;
          const { header, times, poses, poseNumbers } = view.mechanisms[0].motion;
          const body = header.bodies.findIndex((body) => body.name === name);
          const found = view.project(body, r, t);
          // The same by hand, from the numbers of the file and the matrices of the camera.
          const row = times.findIndex((time) => time >= t);
          const share = row > 0 ? (t - times[row - 1]) / (times[row] - times[row - 1]) : 1;
          const mix = (k) => {
            const at = (row) => poses[row * poseNumbers + 7 * body + k];
            return row > 0 ? at(row - 1) + share * (at(row) - at(row - 1)) : at(row);
          };
          const [x, y, z, e0, e1, e2, e3] = [0, 1, 2, 3, 4, 5, 6].map(mix);
          const norm = Math.hypot(e0, e1, e2, e3);
          const [a, b, c, d] = [e0, e1, e2, e3].map((e) => e / norm);
          const turn = [
            [1 - 2 * (c * c + d * d), 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), 1 - 2 * (b * b + d * d), 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), 1 - 2 * (b * b + c * c)],
          ];
          const place = [x, y, z].map((p, k) => p + turn[k][0] * r[0] + turn[k][1] * r[1] + turn[k][2] * r[2]);
          const times4 = (m, v) => [0, 1, 2, 3].map((k) => m[k] * v[0] + m[4 + k] * v[1] + m[8 + k] * v[2] + m[12 + k] * v[3]);
          const seen = times4(view.camera.projectionMatrix.elements, times4(view.camera.matrixWorldInverse.elements, [...place, 1]));
          const { clientWidth, clientHeight } = view.canvas;
          return [found, [(0.5 + (0.5 * seen[0]) / seen[3]) * clientWidth, (0.5 - (0.5 * seen[1]) / seen[3]) * clientHeight]];
        },
        [name, r, t],
      );
      const off = Math.hypot(found[0] - expected[0], found[1] - expected[1]);
      assert.ok(off < 2, `${name} at ${t}: ${off} px`);
    }
  }

  // The canvas is not blank, and changes with the time.
  const canvas = page.locator("#motion canvas");
  const shot = async (t) => {
    await page.evaluate((t) => (window.odyn.clock.set(t), window.odyn.view.draw()), t);
    return canvas.screenshot();
  };
  const [one, two] = [await shot(0), await shot(5)];
  assert.ok(one.length > 5000 && !one.equals(two), "the mechanism is drawn and moves");

  // Labels beside the curves end within their charts.
  const cut = await page.evaluate(() =>
    window.odyn.charts
      .filter(({ ctx, bbox, axes: [, { label, labelFont }] }) => {
        ctx.save();
        ctx.font = [labelFont].flat()[0];
        const { width } = ctx.measureText(label);
        ctx.restore();
        return width > 2 * bbox.top + bbox.height;
      })
      .map((chart) => chart.axes[1].label),
  );
  assert.deepEqual(cut, []);

  // One cursor for everything.
  const over = page.locator(".u-over").first();
  await over.scrollIntoViewIfNeeded();
  const box = await over.boundingBox();
  await page.mouse.move(box.x + box.width / 4, box.y + 50);
  await page.mouse.move(box.x + box.width / 2, box.y + 50);
  const now = await page.evaluate(() => window.odyn.clock.now);
  assert.ok(Math.abs(now - 100) < 1, `the cursor of a chart moves the time: ${now}`);
  await page.mouse.move(5, 5);
  await page.evaluate(() => window.odyn.clock.set(50));
  const left = await page.evaluate(() => window.odyn.charts.map((chart) => chart.posToVal(chart.cursor.left, "x")));
  left.forEach((t) => assert.ok(Math.abs(t - 50) < 1, `the time moves the cursors of charts: ${t}`));

  // By keyboard.
  await canvas.focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("ArrowRight");
  assert.equal(await page.evaluate(() => window.odyn.clock.now), 0.5);
  await page.keyboard.press("Space");
  await page.waitForFunction(() => window.odyn.clock.playing && window.odyn.clock.now > 1);
  await page.keyboard.press("Space");
  assert.equal(await page.evaluate(() => window.odyn.clock.playing), false);

  // Arrows, paths, seen from a body, hidden bodies, pages of the table.
  await page.getByLabel("Arrows", { exact: true }).selectOption("reaction force");
  await page.getByText("Bodies and paths").click();
  await page.getByRole("checkbox", { name: "crank_pin" }).check();
  await page.getByRole("group", { name: "Bodies" }).getByLabel("block").uncheck();
  await page.getByLabel("Seen from").selectOption({ label: "conrod" });
  await page.evaluate(() => window.odyn.clock.set(20));
  await page.waitForTimeout(200);
  await picture(page, "arrows");
  await page.getByLabel("Seen from").selectOption({ label: "ground" });
  await page.getByRole("group", { name: "Bodies" }).getByLabel("block").check();
  await page.getByRole("checkbox", { name: "crank_pin" }).uncheck();
  await page.getByLabel("Arrows", { exact: true }).selectOption("");
  await page.getByRole("button", { name: "Forward" }).click();
  assert.match(await page.locator("#table tbody tr").first().innerText(), /^12\.5\s/);

  await accessible(page, "light");
  await page.evaluate(() => (window.odyn.clock.set(8), scrollTo(0, 0)));
  if (pictures) await canvas.screenshot({ path: join(pictures, "compressor.png") });
  await picture(page, "light", { fullPage: true });
  await page.getByRole("button", { name: "Dark" }).click();
  await accessible(page, "dark");
  await picture(page, "dark", { fullPage: true });
  await page.emulateMedia({ media: "print" });
  await picture(page, "print", { fullPage: true });
  assert.deepEqual(faults, []);
  await context.close();
  const narrow = await open(join(folder, "report.html"), { viewport: { width: 390, height: 800 } });
  await picture(narrow.page, "narrow", { fullPage: true });
  const wide = await narrow.page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(wide <= 391, `a narrow screen is not scrolled sideways: ${wide}`);
  assert.deepEqual(narrow.faults, []);
  await narrow.context.close();
  return ready;
}

async function two() {
  const first = run("scenes/compressor.toml", "first");
  const second = run("scenes/compressor.toml", "second", "--set", "simulation.tolerance=1e-4", "--set", "simulation.output_step=0.7");
  const file = join(work, "two.html");
  execFileSync(odyn, ["report", first, second, "-o", file], { stdio: "ignore" });
  const { page, context, faults } = await open(file);
  assert.equal(await page.evaluate(() => window.odyn.runs.length), 2);
  const curves = () => page.evaluate(() => window.odyn.charts.flatMap((chart) => chart.series.slice(1).map(({ label }) => label)));
  assert.ok((await curves()).includes("second: x_p"));
  await page.getByLabel("Differences from first").check();
  const differences = await page.evaluate(() => {
    const chart = window.odyn.charts.find((chart) => chart.series[1].label === "second: x_p");
    return chart.data[1].reduce((most, x) => Math.max(most, Math.abs(x ?? 0)), 0);
  });
  assert.ok(differences > 0 && differences < 1, `differences of x_p up to ${differences} mm`);
  assert.deepEqual(faults, []);
  await context.close();
}

/** Of runs in other units, differences are in the unit of the chart; where the first run has ended there are none; one sample is a point. */
async function units() {
  const scene = (name, units, x, v, end, step) => {
    const file = join(work, `${name}.toml`);
    const body = `[[body]]\nname = "puck"\nmass = 1\ninertia = [1, 1, 1]\nposition = [${x}, 0, 0]\nvelocity = [${v}, 0, 0]\n`;
    const output = '[[output]]\nname = "x"\nquantity = "position"\nof = "puck"\ncomponent = "x"\n';
    writeFileSync(file, `${units}[simulation]\nt_end = ${end}\noutput_step = ${step}\n${body}${output}`);
    return run(file, name);
  };
  const metres = scene("metres", "", 0.5, 2, 1, 0.1);
  const millimetres = scene("millimetres", '[units]\nlength = "mm"\ntime = "ms"\n', 600, 2, 2000, 100);
  const once = scene("once", "", 0.5, 2, 1, 5);
  const file = join(work, "units.html");
  execFileSync(odyn, ["report", metres, millimetres, once, "-o", file], { stdio: "ignore" });
  const { page, context, faults } = await open(file);
  const points = await page.evaluate(() => window.odyn.charts.flatMap((chart) => chart.series.slice(1).map((s) => [s.label, s.points.show()])));
  assert.deepEqual(points, [["metres: x", false], ["once: x", true], ["millimetres: x", false]]);
  await page.getByLabel("Differences from metres").check();
  const [times, found] = await page.evaluate(() => {
    const chart = window.odyn.charts.find((chart) => chart.series[1].label === "millimetres: x");
    return [[...chart.data[0]], [...chart.data[1]]];
  });
  times.forEach((t, k) => {
    if (t > 1.01) assert.ok(found[k] == null, `a difference at ${t} s, where the first run has ended`);
    else if (found[k] != null) assert.ok(Math.abs(found[k] - 100) < 1e-6, `${found[k]} mm at ${t} s`);
  });
  assert.ok(found.filter((x) => x != null).length === 11, "differences at the samples of the first");
  assert.deepEqual(faults, []);
  await context.close();
}

/** Labels of axes are each another one and fit, of numbers that are large, small, or nearly the same; a body on a long way is seen. */
async function labels() {
  const outputs = ["position x", "velocity y", "angular_velocity x"].map((words) => {
    const [quantity, component] = words.split(" ");
    return `[[output]]\nname = "${quantity}"\nquantity = "${quantity}"\nof = "a"\ncomponent = "${component}"\n`;
  });
  const body =
    '[[body]]\nname = "a"\nmass = 1\ninertia = [1, 1, 1]\nposition = [0.000348206, 2e11, 0]\nvelocity = [1e-12, -5e6, 3e4]\nangular_velocity = [1e-9, 0, 0]\n';
  const file = join(work, "labels.toml");
  writeFileSync(file, `[simulation]\nt_end = 0.1\noutput_step = 0.01\n${body}${outputs.join("")}`);
  const { page, context, faults } = await open(join(run(file, "labels"), "report.html"));
  const found = await page.evaluate(() =>
    window.odyn.charts.map((chart) => {
      chart.ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
      const axis = chart.axes[1];
      const labels = axis._values.filter(Boolean);
      const widest = Math.max(...labels.map((label) => chart.ctx.measureText(label).width / devicePixelRatio));
      return { labels, widest, room: axis._size - 22 - 15 };
    }),
  );
  for (const { labels, widest, room } of found) {
    assert.ok(labels.length > 1 && new Set(labels).size === labels.length, `labels are told apart: ${labels}`);
    assert.ok(widest <= room + 22, `${labels} take ${widest} px of ${room}`);
    assert.ok(labels.every((label) => label.length < 9), `labels are short: ${labels}`);
  }
  const radius = await page.evaluate(() => {
    const { view } = window.odyn;
    const [hub] = view.mechanisms[0].bodies[0].children[0].children;
    const seen = view.camera.position.distanceTo(view.orbit.target) * Math.tan((view.camera.fov * Math.PI) / 360);
    return ((hub.geometry.parameters.radius / seen) * view.canvas.clientHeight) / 2;
  });
  assert.ok(radius > 2, `a body without a shape is ${radius} px large`);
  await picture(page, "labels", { fullPage: true });
  assert.deepEqual(faults, []);
  await context.close();
}

/** What happened to contacts is listed, narrowed to one of them, marked in the plots, and takes everything to its time. */
async function contacts() {
  const folder = run("scenes/verification/plane-contact-friction.toml", "contacts");
  const lines = readFileSync(join(folder, "events.csv"), "utf8").trim().split("\n").slice(1);
  const all = lines.map((line) => line.split(","));
  const { page, context, faults } = await open(join(folder, "report.html"));
  const rows = page.locator("#events tbody tr");
  assert.equal(await rows.count(), Math.min(25, all.length));
  assert.match(await page.locator("#events [role=status]").innerText(), new RegExp(`of ${all.length}$`));
  const [t, name] = all.find(([t, , kind]) => kind === "sticks" && Number(t) > 0);
  await page.getByLabel("Contact").selectOption(name);
  const own = all.filter(([, element]) => element === name);
  assert.equal(await rows.count(), Math.min(25, own.length));
  await rows.nth(own.findIndex((event) => event[0] === t && event[2] === "sticks")).getByRole("button").click();
  assert.ok(Math.abs((await page.evaluate(() => window.odyn.clock.now)) - Number(t)) < 1e-12);
  await page.mouse.move(5, 5);
  const shot = () => page.locator(".chart").first().screenshot();
  const marked = await shot();
  await page.getByRole("checkbox", { name: "Events" }).uncheck();
  assert.ok(!marked.equals(await shot()), "events are marked in plots");
  await page.getByRole("checkbox", { name: "Events" }).check();
  await accessible(page, "contacts");
  await picture(page, "contacts", { fullPage: true });
  assert.deepEqual(faults, []);
  await context.close();
}

/** *Show* chooses a mode: the time stays within its period, the picture is another, and its largest swing is the mode's shape. */
async function modes() {
  const folder = join(work, "modes");
  const scene = "scenes/benchmarks/chain_N10.toml";
  const more = ["--at", "equilibrium", "--json", "-o", folder];
  const found = JSON.parse(execFileSync(odyn, ["modes", scene, ...more], { cwd: repository, stdio: ["ignore", "pipe", "ignore"], maxBuffer: 1 << 26 }));
  execFileSync(odyn, ["report", folder], { stdio: "ignore" });
  const { page, context, faults } = await open(join(folder, "report.html"));
  const show = page.getByLabel("Show", { exact: true });
  const names = await show.locator("option").allInnerTexts();
  assert.equal(names.length, found.modes.length);
  const seen = [];
  for (const k of [0, 1, names.length - 1]) {
    await show.selectOption({ index: k });
    const { from, to, now } = await page.evaluate(() => ({ from: window.odyn.clock.from, to: window.odyn.clock.to, now: window.odyn.clock.now }));
    assert.ok(from === k && Math.abs(to - (k + 1)) < 1e-6 && now >= from && now <= to, `${names[k]}: ${from} to ${to}, now ${now}`);
    await page.evaluate((t) => (window.odyn.clock.set(t), window.odyn.view.draw()), k);
    seen.push(await page.locator("#motion canvas").screenshot());
    await picture(page, `mode-${k + 1}`);
  }
  assert.ok(!seen[0].equals(seen[1]) && !seen[1].equals(seen[2]), "modes look alike");
  await accessible(page, "modes");
  assert.deepEqual(faults, []);
  await context.close();
}

/** Names that would be scripts if anything took them for HTML. */
async function hostile() {
  const evil = "<script>document.title='taken'</script><img src=x onerror=document.title='taken'>";
  // Scenes may have any title, but no such names; so they are written into what the run left.
  writeFileSync(
    join(work, "evil.toml"),
    `title = ${JSON.stringify(evil)}\n[simulation]\nt_end = 1\noutput_step = 0.1\n[[body]]\nname = "harmless"\nmass = 1\ninertia = [1, 1, 1]\n` +
      `[[output]]\nname = "harmless"\nquantity = "position"\nof = "harmless"\ncomponent = "x"\n`,
  );
  const folder = run(join(work, "evil.toml"), "evil");
  for (const name of ["results.csv", "channels.json", "summary.json", "motion.bin"]) {
    const text = readFileSync(join(folder, name), "latin1").replace(/\n\s*"results_sha256.*/, "");
    const written = name === "results.csv" ? evil : JSON.stringify(evil).slice(1, -1);
    writeFileSync(join(folder, name), text.replaceAll("harmless", written), "latin1");
  }
  execFileSync(odyn, ["report", folder], { stdio: "ignore" });
  const { page, context, faults } = await open(join(folder, "report.html"));
  assert.equal(await page.title(), evil);
  assert.equal(await page.locator("h1").innerText(), evil);
  assert.equal(await page.locator("img").count(), 0);
  await page.getByText("Bodies and paths").click();
  assert.equal(await page.title(), evil);
  assert.deepEqual(faults, []);
  await context.close();
}

/** Chains of links of this length that fall, hung up at the origin. */
function chain(links, length, unit) {
  const parts = Array.from({ length: links }, (_, k) => {
    const body = `[[body]]\nname = "b${k}"\nmass = 1\ninertia = [1e-3, "0.1 kg ${unit}^2", "0.1 kg ${unit}^2"]\nposition = [${(k + 0.5) * length}, 0, 0]\n`;
    const bodies = `bodies = ["${k ? `b${k - 1}` : "ground"}", "b${k}"]`;
    return `${body}[[joint]]\nname = "j${k}"\ntype = "revolute"\n${bodies}\npoint = [${k * length}, 0, 0]\naxis = [0, 1, 0]\n`;
  });
  const file = join(work, `chain-${links}-${unit}.toml`);
  const head = `[units]\nlength = "${unit}"\n[plugins]\nlibraries = ["joints"]\n[simulation]\nt_end = 0.1\noutput_step = 0.05\n`;
  writeFileSync(file, head + parts.join(""));
  return run(file, `chain-${links}-${unit}`);
}

/** What is seen of scenes of any size: glyphs are no larger than links, and nothing is looked at from within. */
async function sizes() {
  const look = async (folder) => {
    const { page, context, faults } = await open(join(folder, "report.html"));
    const found = await page.evaluate(() => {
      const { view } = window.odyn;
      const [mechanism] = view.mechanisms;
      const distance = view.camera.position.distanceTo(view.orbit.target);
      return { size: mechanism.size, length: view.length, distance, parts: mechanism.bodies.map((body) => body.children[0].children.length) };
    });
    assert.deepEqual(faults, []);
    await context.close();
    return found;
  };
  const long = await look(chain(200, 0.3, "m"));
  assert.ok(long.size < 0.6 * 0.3, `glyphs of ${long.size} m on links of 0.3 m`);
  const tiny = await look(chain(4, 1, "nm"));
  assert.ok(tiny.parts.every((parts) => parts > 1), `a ball and its bars: ${tiny.parts}`);
  // Alone, beside the origin: its poses differ by round-off.
  const file = join(work, "flywheel.toml");
  const wheel = `[[body]]\nname = "wheel"\nmass = 5\ninertia = [2e4, 2e4, 4e4]\nposition = [300, 0, 0]\nangular_velocity = [0, 0, 10]\n`;
  const bearing = `[[joint]]\nname = "bearing"\ntype = "revolute"\nbodies = ["ground", "wheel"]\npoint = [300, 0, 0]\n`;
  const head = `[units]\nlength = "mm"\n[plugins]\nlibraries = ["joints"]\n[simulation]\nt_end = 1\noutput_step = 0.01\n`;
  writeFileSync(file, head + wheel + bearing);
  const alone = await look(run(file, "flywheel"));
  assert.ok(alone.distance > alone.size, `seen from ${alone.distance} m, ${alone.size} m large`);
}

/** A scene of boxes that fly and turn. */
function boxes(count, samples) {
  const bodies = Array.from({ length: count }, (_, k) => {
    const place = `position = [${0.3 * k}, 0, 0]\nvelocity = [0, 0, ${0.1 * k}]\nangular_velocity = [1, ${k % 20}, 0]`;
    return `[[body]]\nname = "b${k}"\nmass = 1\ninertia = [1, 1.1, 1.2]\n${place}\n[[body.shape]]\nkind = "box"\nsize = [0.2, 0.1, 0.1]\n`;
  });
  const file = join(work, `boxes-${count}.toml`);
  writeFileSync(file, `[simulation]\nt_end = 5\noutput_step = ${5 / samples}\n${bodies.join("")}`);
  return run(file, `boxes-${count}`);
}

/** How long the page of 100 bodies and 2000 samples takes, ms, and how large it is, MB. */
async function large() {
  const file = join(boxes(100, 2000), "report.html");
  const { page, context, faults, ready } = await open(file);
  assert.equal(await page.evaluate(() => window.odyn.runs[0].motion.samples), 2001);
  assert.deepEqual(faults, []);
  await context.close();
  return [ready, statSync(file).size / 1e6];
}

async function frames() {
  const folder = boxes(20, 500);
  const { page, context, faults } = await open(join(folder, "report.html"), { viewport: { width: 832, height: 970 } });
  await page.addStyleTag({ content: ".stage{height:600px!important}" });
  const rate = await page.evaluate(async () => {
    const { view, clock } = window.odyn;
    await new Promise((done) => setTimeout(done, 300));
    clock.play(true);
    const [from, started] = [view.drawn, performance.now()];
    await new Promise((done) => setTimeout(done, 3000));
    clock.play(false);
    return (1000 * (view.drawn - from)) / (performance.now() - started);
  });
  await picture(page, "twenty");
  assert.deepEqual(faults, []);
  await context.close();
  return rate;
}

try {
  const ready = await compressor();
  await two();
  await units();
  await labels();
  await sizes();
  await contacts();
  await modes();
  await hostile();
  const rate = await frames();
  const [waited, megabytes] = await large();
  console.log(`100 bodies and 2000 samples: ${megabytes.toFixed(1)} MB, ready in ${waited} ms`);
  console.log(`reports in the browser: ok; ready in ${ready} ms, 20 bodies at ${rate.toFixed(0)} frames a second`);
} finally {
  await browser.close();
}
