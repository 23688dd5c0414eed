// Elements of the installed libraries, each with its manual page, to be inserted into the scene.

import { el } from "../dom.js";
import { go } from "./editor.js";
import { names, tables, word } from "./toml.js";

/** Fills a place with the list of elements. */
export function inserter(place, view, known) {
  const page = el("div", { class: "page", tabindex: "0", role: "region", "aria-label": "Manual page" });
  const filter = el("input", { type: "search", placeholder: "Filter", "aria-label": "Filter elements" });
  const list = el("ul", { class: "elements" });
  const show = (element, button) => {
    list.querySelectorAll("[aria-current]").forEach((other) => other.removeAttribute("aria-current"));
    button.setAttribute("aria-current", "true");
    page.replaceChildren(
      el("div", { class: "bar" }, el("h3", {}, element.name), el("button", { type: "button", class: "insert", onclick: () => insert(view, element) }, "Insert into the scene")),
      el("p", { class: "small" }, `${element.kind} of ${element.library}: ${element.summary}`),
      manual(element.page),
    );
  };
  const draw = () => {
    const wanted = filter.value.toLowerCase();
    const fits = ({ name, summary, kind, library }) => [name, summary, kind, library].some((text) => text.toLowerCase().includes(wanted));
    list.replaceChildren(
      ...known.elements.filter(fits).map((element) => {
        const button = el("button", { type: "button", onclick: () => show(element, button) }, element.name, el("small", {}, ` ${element.kind}`));
        return el("li", {}, button);
      }),
    );
  };
  filter.addEventListener("input", draw);
  draw();
  const left = known.leftOut.length ? el("p", { class: "bad" }, `Left out: ${known.leftOut.join("; ")}`) : null;
  place.replaceChildren(el("div", { class: "inserter" }, el("div", {}, filter, list), page), ...(left ? [left] : []));
}

/** A manual page, which the program made of Markdown: HTML in it is shown, not obeyed. */
function manual(html) {
  const part = el("div");
  part.innerHTML = html;
  return part;
}

/** Puts an element behind the others of its kind, with names that the scene has, and its library among those that are loaded. */
function insert(view, element) {
  const text = view.state.doc.toString();
  const all = tables(text);
  let own = element.text;
  const bodies = names(all, "body");
  let next = 0;
  own = own.replace(/^bodies\s*=\s*\[([^\]]*)\]/m, (_, list) => {
    const given = list.split(",").map((name) => name.trim().replaceAll('"', ""));
    const chosen = given.map((name) => (name === "ground" || bodies.includes(name) ? name : (bodies[next++] ?? name)));
    return `bodies = [${chosen.map((name) => JSON.stringify(name)).join(", ")}]`;
  });
  const taken = names(all, "body", "joint", "force", "control", "input");
  own = own.replace(/^name\s*=\s*"([^"]*)"/m, (_, name) => {
    let free = name;
    for (let k = 2; taken.includes(free); k++) free = `${name}_${k}`;
    return `name = "${free}"`;
  });
  const last = all.filter((table) => table.path[0] === element.kind).at(-1) ?? all.filter((table) => ["body", "joint", "force"].includes(table.path[0])).at(-1) ?? all.at(-1);
  const end = last.keys.length ? view.state.doc.lineAt(last.keys.at(-1).to).to : last.to;
  const changes = [{ from: end, insert: `\n\n${own.trimEnd()}` }, ...library(all, element.library)];
  view.dispatch({ changes });
  const place = view.state.doc.toString().indexOf(own.trimEnd());
  go(view, Math.max(place, 0));
}

/** The change that makes a scene load a library, if it does not. */
function library(all, name) {
  const plugins = all.find((table) => table.path[0] === "plugins");
  const list = plugins?.keys.find((key) => key.path[0] === "libraries");
  const known = list?.value.match(/"[^"]*"/g)?.map((word) => word.slice(1, -1)) ?? [];
  // Short names stand for packages: `joints` for `odyn-joints`.
  if (known.some((other) => other === name || name === `odyn-${other}`)) return [];
  if (!plugins) return [{ from: word(all[0], "title") ? all[0].keys[0].to : 0, insert: `\n\n[plugins]\nlibraries = [${JSON.stringify(name)}]\n` }];
  if (!list) return [{ from: plugins.body, insert: `libraries = [${JSON.stringify(name)}]\n` }];
  const inner = list.value.slice(1, -1).trim().replace(/,$/, "");
  return [{ from: list.from, to: list.to, insert: `[${inner ? `${inner}, ` : ""}${JSON.stringify(name)}]` }];
}
