// The studio: the text of a scene on the left, what the solver makes of it on the right.

import "../locale.js";
import { download, el } from "../dom.js";
import { theme } from "../theme.js";
import { Gone, Refused, get, post } from "./api.js";
import { annotate, details, editor, go, replace } from "./editor.js";
import { form } from "./form.js";
import { inserter } from "./insert.js";
import { Runs } from "./runs.js";
import { Still } from "./still.js";
import style from "./style.css";
import { tableAt, tables, word } from "./toml.js";

/** Time without a key pressed before the solver is asked, ms. */
const QUIET = 250;
const RETRY = 2000;

const known = { schema: null, elements: [], leftOut: [] };
const state = { path: null, saved: "", version: "", checked: null, checking: false, answer: null, redundant: [] };

async function begin() {
  document.head.append(el("style", {}, style));
  const page = build();
  theme();
  const scene = await get("/api/scene");
  Object.assign(state, { path: scene.path, saved: scene.text, version: scene.version });
  page.name.textContent = scene.path ?? "untitled";
  document.title = `${(scene.path ?? "untitled").split("/").at(-1)} - O-DYN studio`;
  let timer;
  const later = () => {
    clearTimeout(timer);
    timer = setTimeout(check, QUIET);
  };
  const view = editor(page.editor, scene.text, known, {
    changed: () => {
      mark();
      keep();
      later();
    },
    moved: () => {
      if (!page.panels.form.hidden) form(page.panels.form, view, known);
      follow();
    },
    save: () => store(),
    run: () => run(),
  });
  const text = () => view.state.doc.toString();
  const still = new Still(page.still);
  const runs = new Runs(page.bar, page.panels.results, {
    run: () => run(),
    messages: (messages) => messages && list(messages),
    shown: () => choose("results"),
    failed: (error) => error instanceof Gone && gone(),
  });

  function choose(name) {
    for (const [other, panel] of Object.entries(page.panels)) {
      panel.hidden = other !== name;
      page.tabs[other].setAttribute("aria-selected", String(other === name));
      page.tabs[other].tabIndex = other === name ? 0 : -1;
    }
    if (name === "form") form(page.panels.form, view, known);
    dispatchEvent(new Event("resize"));
  }
  for (const [name, tab] of Object.entries(page.tabs)) {
    tab.addEventListener("click", () => choose(name));
    tab.addEventListener("keydown", (event) => {
      const order = Object.keys(page.tabs);
      const step = { ArrowRight: 1, ArrowLeft: order.length - 1 }[event.key];
      if (!step) return;
      const next = order[(order.indexOf(name) + step) % order.length];
      choose(next);
      page.tabs[next].focus();
    });
  }

  /** Asks the solver about the text; once more if it changed meanwhile. */
  async function check() {
    if (state.checking) return;
    state.checking = true;
    try {
      do {
        const asked = text();
        const answer = await post("/api/check", asked);
        state.checked = asked;
        if (asked === text()) take(answer);
      } while (state.checked !== text());
      notice(null, "gone");
    } catch (error) {
      if (error instanceof Gone) gone();
      else notice(error.message, "refused");
    } finally {
      state.checking = false;
    }
  }

  function take(answer) {
    state.answer = answer;
    list(answer.messages);
    const wrong = answer.messages.filter(({ severity }) => severity === "error").length;
    page.state.className = answer.ok ? "good" : "bad";
    page.state.textContent = answer.ok
      ? `mobility ${answer.mobility}${answer.redundant.length ? `, ${answer.redundant.length} redundant rows` : ""}`
      : `${wrong} ${wrong === 1 ? "error" : "errors"}`;
    if (!answer.ok) {
      page.still.classList.add("stale");
      return;
    }
    page.still.classList.remove("stale");
    page.plan.textContent = answer.plan;
    page.facts.textContent = answer.report;
    state.redundant = [...new Set(answer.redundant.map((row) => row.slice(0, row.lastIndexOf(":"))))];
    rows(answer.redundant);
    if (answer.picture) {
      try {
        still.show(answer.picture);
      } catch (error) {
        page.still.replaceChildren(el("p", { class: "note" }, `The mechanism cannot be drawn here: ${error.message}`));
      }
    }
    follow();
  }

  /** Redundant rows, each leading to its joint. */
  function rows(redundant) {
    const entry = (row) => {
      const joint = row.slice(0, row.lastIndexOf(":"));
      return el("li", {}, el("button", { type: "button", class: "link", onclick: () => seek(joint) }, row));
    };
    page.rows.replaceChildren(
      ...(redundant.length ? [el("h3", {}, "Redundant rows, lit up in the picture"), el("ul", {}, ...redundant.map(entry))] : []),
    );
  }

  /** Goes to the table of a name. */
  function seek(name) {
    const found = tables(text()).find((table) => ["body", "joint", "force", "control"].includes(table.path[0]) && word(table, "name") === name);
    if (found) go(view, found.from);
  }

  /** The element or body at the cursor is lit, and what is redundant. */
  function follow() {
    const [table] = tableAt(tables(text()), view.state.selection.main.head);
    const own = ["body", "joint", "force"].includes(table.path[0]) ? word(table, "name") : "";
    const names = [...state.redundant, own].filter(Boolean);
    if (names.join("\n") !== still.marked.join("\n")) still.light(names);
  }

  function list(messages) {
    annotate(view, messages);
    const entry = (message) => {
      const place = message.line === null ? "" : `line ${message.line}: `;
      const head = el("button", { type: "button", class: "link", onclick: () => message.line !== null && go(view, message.from) }, `${place}${message.severity}${message.code ? ` [${message.code}]` : ""}`);
      return el("li", { class: message.severity === "error" ? "error" : "" }, head, details(message));
    };
    page.messages.replaceChildren(...messages.map(entry));
    page.none.hidden = messages.length > 0;
  }

  function run() {
    runs.begin(text());
  }

  function mark() {
    const changed = text() !== state.saved;
    page.saved.textContent = changed ? "not saved" : "";
    page.save.disabled = !state.path || !changed;
  }

  /** Hands the text over as a file, where it cannot be saved. */
  function keepCopy() {
    download("scene.toml", new Blob([text()]));
  }

  /** Writes the text into the file. */
  async function store(version = state.version) {
    if (!state.path) {
      keepCopy();
      return;
    }
    const own = text();
    try {
      const answer = await post(`/api/save?version=${version}`, own);
      Object.assign(state, { saved: own, version: answer.version });
      forget();
      notice(null, "conflict");
      notice(null, "gone");
    } catch (error) {
      if (error instanceof Gone) gone();
      else if (error instanceof Refused && error.status === 409) conflict(JSON.parse(error.message));
      else notice(error.message, "refused");
    }
    mark();
  }

  /** The file is another than the one that this page knows. */
  function conflict({ text: other, version }) {
    notice(
      "The file was changed elsewhere since this page read it. Nothing was written.",
      "conflict",
      ["Overwrite the file", () => store(version)],
      [
        "Load the file",
        () => {
          Object.assign(state, { saved: other, version });
          replace(view, other);
          notice(null, "conflict");
          mark();
        },
      ],
    );
  }

  function gone() {
    notice("The program does not answer: was `odyn studio` ended? The text is still here.", "gone", ["Save as file", keepCopy]);
    clearTimeout(state.retry);
    state.retry = setTimeout(check, RETRY);
  }

  /** A bar with words and buttons; `null` takes that of its kind away. */
  function notice(words, kind, ...buttons) {
    const before = page.notices.querySelector(`[data-kind=${kind}]`);
    if (before && words !== null && before.dataset.words === words) return;
    before?.remove();
    if (words === null) return;
    page.notices.append(
      el(
        "div",
        { "data-kind": kind, "data-words": words, class: "notice" },
        words,
        ...buttons.map(([name, action]) => el("button", { type: "button", onclick: action }, name)),
        el("button", { type: "button", "aria-label": "Close this notice", onclick: (event) => event.target.parentElement.remove() }, "\u00d7"),
      ),
    );
  }

  // What is not saved survives the page, on this machine and for this file.
  const key = `odyn-studio ${state.path}`;
  let keeping;
  function keep() {
    clearTimeout(keeping);
    keeping = setTimeout(() => {
      if (text() === state.saved) return forget();
      try {
        localStorage.setItem(key, text());
      } catch {
        // Without room for it, the warning of the browser on leaving the page is what remains.
      }
    }, QUIET);
  }
  function forget() {
    clearTimeout(keeping);
    localStorage.removeItem(key);
  }
  const draft = localStorage.getItem(key);
  if (draft !== null && draft !== scene.text) {
    notice("There is unsaved text from an earlier session.", "draft", ["Restore it", () => (replace(view, draft), notice(null, "draft"))], ["Discard it", () => (forget(), notice(null, "draft"))]);
  }
  addEventListener("beforeunload", (event) => text() !== state.saved && event.preventDefault());
  // Another tab or program may have written the file meanwhile.
  addEventListener("focus", async () => {
    const other = await get("/api/scene").catch(() => null);
    if (!other || other.version === state.version) return;
    if (text() === state.saved) {
      Object.assign(state, { saved: other.text, version: other.version });
      replace(view, other.text);
      mark();
    } else if (other.text !== text()) conflict(other);
  });

  page.save.addEventListener("click", () => store());
  page.whole.addEventListener("click", () => still.view?.frame());
  mark();
  check();
  try {
    const all = await get("/api/elements");
    Object.assign(known, { schema: { root: all.schema }, elements: all.elements, leftOut: all.left_out });
    inserter(page.panels.elements, view, known);
    if (!page.panels.form.hidden) form(page.panels.form, view, known);
  } catch (error) {
    notice(`Elements cannot be listed: ${error.message}`, "elements");
  }
  // For tests, and for whoever opens the console.
  window.odyn = { view, still, runs, state, known };
  document.documentElement.dataset.ready = "yes";
}

/** The page without content. */
function build() {
  const root = document.getElementById("studio");
  const make = (tag, attributes = {}, ...children) => el(tag, attributes, ...children);
  const page = {
    name: make("code"),
    state: make("span", { role: "status", id: "state" }),
    saved: make("span", { class: "small" }),
    save: make("button", { type: "button", disabled: true, title: "Ctrl+S" }, "Save"),
    bar: make("div", { class: "bar" }),
    notices: make("div", { role: "alert", class: "notices" }),
    editor: make("div", { class: "text" }),
    messages: make("ul", { class: "messages", id: "messages" }),
    none: make("p", { class: "note" }, "No messages."),
    still: make("div", { class: "still" }, make("p", { class: "note" }, "The mechanism is shown as soon as it can be assembled.")),
    whole: make("button", { type: "button" }, "Whole view"),
    rows: make("div"),
    facts: make("pre", { tabindex: "0" }),
    plan: make("pre", { tabindex: "0" }),
  };
  page.panels = {
    mechanism: make("div", {}, page.still, make("div", { class: "bar" }, page.whole), page.rows, make("h3", {}, "What assembly found"), page.facts),
    results: make("div"),
    plan: make("div", {}, page.plan),
    form: make("div", { class: "form" }),
    elements: make("div"),
  };
  const titles = { mechanism: "Mechanism", results: "Results", plan: "Plan", form: "Form", elements: "Insert element" };
  page.tabs = {};
  for (const [name, panel] of Object.entries(page.panels)) {
    Object.assign(panel, { id: `panel-${name}`, hidden: name !== "mechanism" });
    panel.setAttribute("role", "tabpanel");
    panel.setAttribute("aria-label", titles[name]);
    page.tabs[name] = make("button", { type: "button", role: "tab", "aria-controls": panel.id, "aria-selected": String(name === "mechanism"), tabindex: name === "mechanism" ? "0" : "-1" }, titles[name]);
  }
  root.append(
    make("header", {}, make("h1", {}, "O-DYN studio"), page.name, page.saved, page.save, page.state, page.bar),
    page.notices,
    make(
      "main",
      {},
      make("section", { class: "left", "aria-label": "Scene" }, page.editor, make("div", { class: "below", tabindex: "0", role: "region", "aria-label": "Messages" }, page.none, page.messages)),
      make(
        "section",
        { class: "right", "aria-label": "What the solver makes of it" },
        make("div", { role: "tablist", class: "tabs", "aria-label": "Views" }, ...Object.values(page.tabs)),
        make("div", { class: "panels" }, ...Object.values(page.panels)),
      ),
    ),
  );
  return page;
}

begin().catch((error) => {
  document.getElementById("studio").append(el("p", { class: "bad" }, `The studio cannot be shown: ${error.message}`));
  throw error;
});
