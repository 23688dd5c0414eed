// The studio in a real browser: node studio.js ODYN REPO [FOLDER FOR PICTURES]
//
// Checks that a mistake is shown at its line while it is written, that a scene that was put right runs and is plotted, that
// nobody else is answered, and that no text that was saved is lost.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { copyFileSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { tables, word } from "./toml.js";
import { accessible, browser, odyn, picture, repository, work } from "./common.js";

const programs = [];

/** Starts the program; gives its address when it listens. */
async function start(scene, ...more) {
  const program = spawn(odyn, ["studio", scene, ...more], { cwd: work, stdio: ["ignore", "pipe", "inherit"] });
  programs.push(program);
  const address = await new Promise((found, failed) => {
    let text = "";
    program.stdout.on("data", (part) => {
      text += part;
      const match = /studio: (\S+)/.exec(text);
      if (match) found(match[1]);
    });
    program.on("exit", (code) => failed(new Error(`odyn studio ended with ${code}`)));
  });
  return { program, address };
}

const ended = (program) => new Promise((done) => (program.exitCode === null && program.signalCode === null ? program.once("exit", done) : done()));

async function open(address, context) {
  const page = await context.newPage();
  const faults = [];
  const own = new URL(address).origin;
  page.on("request", (request) => request.url().startsWith(`${own}/`) || /^(blob|data):/.test(request.url()) || faults.push(`request ${request.url()}`));
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  page.on("pageerror", (error) => faults.push(String(error)));
  await page.goto(address);
  await page.waitForSelector("html[data-ready=yes]", { timeout: 20000 });
  return { page, faults };
}

const text = (page) => page.evaluate(() => window.odyn.view.state.doc.toString());
const state = (page) => page.locator("#state");

/** Puts the cursor behind a text, and types. */
async function type(page, behind, keys) {
  await page.evaluate((behind) => {
    const { view } = window.odyn;
    const at = view.state.doc.toString().indexOf(behind) + behind.length;
    view.dispatch({ selection: { anchor: at }, scrollIntoView: true });
    view.focus();
  }, behind);
  await page.keyboard.type(keys);
}

/** Where tables and values are in texts of all kinds. */
function places() {
  const sample =
    'title = "a # no comment" # one\n[simulation]\nt_end = 1 # [no] = header\ntext = """\n[[body]]\nname = "none"\n"""\n' +
    '[[body]]\n"name" = "b [1]"\ninertia = [ # of\n  1, 2, # [\n  3,\n]\nparams . mu = 0.5\n[[body.shape]]\nkind = \'box\'';
  const found = tables(sample);
  assert.deepEqual(found.map(({ path }) => path.join(".")), ["", "simulation", "body", "body.shape"]);
  assert.deepEqual(found.map((table) => table.keys.map((key) => key.path.join("."))), [["title"], ["t_end", "text"], ["name", "inertia", "params.mu"], ["kind"]]);
  assert.equal(found[0].keys[0].value, '"a # no comment"');
  assert.equal(found[1].keys[0].value, "1");
  assert.equal(found[2].keys[1].value, "[ # of\n  1, 2, # [\n  3,\n]");
  assert.equal(word(found[2], "name"), "b [1]");
  assert.equal(word(found[3], "kind"), "box");
  // Texts that are being written end anywhere.
  for (let end = 0; end <= sample.length; end++) tables(sample.slice(0, end));
}

async function writing() {
  const scene = join(work, "compressor.toml");
  copyFileSync(join(repository, "scenes/compressor.toml"), scene);
  const { program, address } = await start("compressor.toml");
  const context = await browser.newContext({ viewport: { width: 1500, height: 950 }, reducedMotion: "reduce" });
  const { page, faults } = await open(address, context);
  await state(page).filter({ hasText: "mobility 1, 2 redundant rows" }).waitFor();
  await page.waitForFunction(() => window.odyn.still.ready);
  assert.deepEqual(await page.evaluate(() => window.odyn.still.marked), ["main_bearing"], "the joint with redundant rows is lit");
  await picture(page, "studio");
  await accessible(page, "studio");

  // A mistake is shown at its line, and gone when it is put right; the picture stays meanwhile.
  const before = await text(page);
  await type(page, 'name = "piston"\nmas', "x");
  await state(page).filter({ hasText: "error" }).waitFor();
  const line = before.slice(0, before.indexOf('name = "piston"')).split("\n").length + 1;
  const messages = page.locator("#messages li.error");
  await messages.filter({ hasText: `line ${line}:` }).first().waitFor();
  await page.waitForFunction(() => document.querySelectorAll(".cm-lint-marker-error").length > 0);
  await picture(page, "studio-mistake");
  await page.keyboard.press("Backspace");
  await state(page).filter({ hasText: "mobility 1" }).waitFor();
  assert.equal(await text(page), before);

  // What is run is the text, saved or not.
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.waitForFunction(() => window.odyn.runs.shown?.charts.length > 0, null, { timeout: 30000 });
  const plotted = await page.evaluate(() => {
    const [run] = window.odyn.runs.shown.runs;
    const stroke = run.channels.find(({ name }) => name === "x_p").values;
    return { rows: run.times.length, least: Math.min(...stroke), most: Math.max(...stroke), drawn: window.odyn.runs.shown.view.mechanisms.length };
  });
  assert.equal(plotted.rows, 401);
  assert.ok(plotted.most - plotted.least > 16.9 && plotted.most - plotted.least < 17.1, `stroke ${plotted.most - plotted.least} mm`);
  assert.equal(plotted.drawn, 1);
  await picture(page, "studio-run");
  await accessible(page, "studio with results");

  // Changed by the form, and compared with the run before.
  await page.evaluate(() => {
    const { view } = window.odyn;
    view.dispatch({ selection: { anchor: view.state.doc.toString().indexOf("crank.radius") } });
  });
  await page.getByRole("tab", { name: "Form" }).click();
  await page.evaluate(() => {
    const { view } = window.odyn;
    view.dispatch({ selection: { anchor: view.state.doc.toString().indexOf("[simulation]") + 2 } });
  });
  const end = page.getByLabel(/^t_end/);
  await end.fill("50 ms");
  await end.press("Enter");
  await page.waitForFunction(() => /t_end = "50 ms"/.test(window.odyn.view.state.doc.toString()));
  await accessible(page, "form");
  await picture(page, "studio-form");
  await page.getByLabel("Compare with last").check();
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.waitForFunction(() => window.odyn.runs.shown?.runs.length === 2, null, { timeout: 30000 });
  assert.deepEqual(await page.evaluate(() => window.odyn.runs.shown.runs.map((run) => run.times.length)), [101, 401]);

  // An element with its manual page, inserted with its library.
  await page.getByRole("tab", { name: "Insert element" }).click();
  await page.getByLabel("Filter elements").fill("translational-spring");
  await page.getByRole("button", { name: /translational-spring-damper/ }).click();
  await page.getByRole("region", { name: "Manual page" }).getByText("Equations").waitFor();
  await accessible(page, "manual page");
  await picture(page, "studio-insert");
  await page.getByRole("button", { name: "Insert into the scene" }).click();
  const inserted = await text(page);
  assert.match(inserted, /libraries = \["joints", "compressor", "odyn-forces"\]/);
  assert.match(inserted, /\[\[force\]\]\nname = "[^"]+"\ntype = "translational-spring-damper"\nbodies = \[/);
  await state(page).filter({ hasText: "mobility 1" }).waitFor();

  // Completion: words of the schema, elements, names of the scene.
  await type(page, inserted.trimEnd().slice(-40), '\n\n[[output]]\nname = "extra"\nquantity = "');
  await page.locator(".cm-tooltip-autocomplete").waitFor();
  const offered = await page.locator(".cm-tooltip-autocomplete li").allInnerTexts();
  assert.ok(offered.some((word) => word.includes("angular_velocity")), offered.join());
  await page.keyboard.press("Escape");

  // Saved only now, and as a whole.
  assert.equal(readFileSync(scene, "utf8"), before);
  await page.keyboard.press("Control+s");
  await page.waitForFunction(() => window.odyn.state.saved === window.odyn.view.state.doc.toString());
  assert.equal(readFileSync(scene, "utf8"), await text(page));
  assert.deepEqual(faults, []);
  await page.close();
  program.kill("SIGINT");
  await ended(program);
  await context.close();
}

/** Who is not the own page is refused: another origin, a page without token. */
async function strangers() {
  const scene = join(work, "strangers.toml");
  copyFileSync(join(repository, "scenes/compressor.toml"), scene);
  const { program, address } = await start(scene);
  const { origin, search } = new URL(address);
  const context = await browser.newContext();
  const page = await context.newPage();
  const answer = await page.goto(`${origin}/`);
  assert.equal(answer.status(), 403);
  assert.match(await page.innerText("body"), /token/);
  // A page of another origin that has even got hold of the token.
  await page.route("http://example.test/", (route) => route.fulfill({ body: "<p>elsewhere</p>", contentType: "text/html" }));
  await page.goto("http://example.test/");
  const tried = await page.evaluate(async ([origin, search]) => {
    const results = [];
    for (const options of [{}, { method: "POST", body: "x" }, { headers: { "X-Odyn-Token": search.slice(7) } }, { mode: "no-cors", method: "POST", body: "x" }]) {
      for (const path of ["/api/scene", `/api/save${search}&version=`]) {
        results.push(await fetch(origin + path, options).then(async (answer) => `${answer.type} ${await answer.text()}`, () => "refused"));
      }
    }
    return results;
  }, [origin, search]);
  assert.ok(tried.every((result) => result === "refused" || result === "opaque "), tried.join("; "));
  assert.equal(readFileSync(scene, "utf8"), readFileSync(join(repository, "scenes/compressor.toml"), "utf8"));
  program.kill("SIGINT");
  await ended(program);
  await context.close();
}

/** Two tabs, and a program that is killed. */
async function safety() {
  const scene = join(work, "tabs.toml");
  const original = readFileSync(join(repository, "scenes/verification/joint-friction-loop.toml"), "utf8");
  writeFileSync(scene, original);
  const { program, address } = await start(scene);
  const context = await browser.newContext({ viewport: { width: 1300, height: 800 } });
  const [one, two] = [await open(address, context), await open(address, context)];
  await type(one.page, "output_step = 0.01", "5 # first");
  await one.page.keyboard.press("Control+s");
  await one.page.waitForFunction(() => window.odyn.state.saved.includes("# first"));
  await type(two.page, "t_end = 0.5", " # second");
  await two.page.keyboard.press("Control+s");
  await two.page.getByText("changed elsewhere").waitFor();
  assert.ok(!readFileSync(scene, "utf8").includes("# second"), "the second tab writes nothing over the first");
  await picture(two.page, "studio-conflict");
  await two.page.getByRole("button", { name: "Overwrite the file" }).click();
  await two.page.waitForFunction(() => window.odyn.state.saved.includes("# second"));
  const saved = readFileSync(scene, "utf8");
  assert.ok(saved.includes("# second") && !saved.includes("# first"));

  // Killed: what was saved is whole, what was not stays in the page and comes back with the next start.
  await type(two.page, "# second", " and unsaved");
  const unsaved = await text(two.page);
  program.kill("SIGKILL");
  await ended(program);
  await type(two.page, "and unsaved", ", still");
  await two.page.getByText("does not answer").waitFor();
  assert.equal(readFileSync(scene, "utf8"), saved);
  assert.equal(await text(two.page), unsaved.replace("and unsaved", "and unsaved, still"));
  const { port } = new URL(address);
  const next = await start(scene, "--port", port);
  const third = await open(next.address, context);
  await third.page.getByText("unsaved text").waitFor();
  await third.page.getByRole("button", { name: "Restore it" }).click();
  assert.ok((await text(third.page)).includes("and unsaved, still"));
  assert.deepEqual([...one.faults, ...third.faults], []);
  next.program.kill("SIGINT");
  await ended(next.program);
  await context.close();
}

try {
  places();
  await writing();
  await strangers();
  await safety();
  console.log("studio in the browser: ok");
} finally {
  programs.forEach((program) => program.kill("SIGKILL"));
  await browser.close();
}
