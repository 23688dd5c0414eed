// The table at the cursor as a form: what its keys mean, and what they may be. The text stays what counts.

import { el } from "../dom.js";
import { keysOf, meaning, resolve, schemaAt, tableAt, tables, word, words } from "./toml.js";

/** Fills a place with the form of the table at the cursor of an editor. */
export function form(place, view, known) {
  if (!known.schema) return;
  const text = view.state.doc.toString();
  const at = view.state.selection.main.head;
  const [table, number] = tableAt(tables(text), at);
  const type = word(table, "type");
  const rows = [];
  const add = (path) => {
    const parts = schemaAt(known.schema, [...table.path, ...path], type);
    for (const [name, given, needed] of keysOf(known.schema, parts, type)) {
      const node = { ...given, ...resolve(known.schema, given) };
      const own = [...path, name];
      const single = path.length === 0 && (node.properties || ["params", "inputs"].includes(name));
      if (single && !(node.items ?? null)) add(own);
      else if (!(node.items?.properties && table.path.length <= 1 && path.length === 0)) rows.push([own, node, needed]);
    }
  };
  if (table.path.length) add([]);
  const title = table.path.length ? `${table.array ? "[[" : "["}${table.path.join(".")}${table.array ? "]]" : "]"} ${word(table, "name")}` : "";
  if (!rows.length) {
    place.replaceChildren(el("p", { class: "note" }, "Put the cursor into a table of the scene, such as [[body]] or [simulation]: its keys are shown here with what they mean."));
    return;
  }
  // While somebody writes into the form, it stays.
  const key = `${number} ${type} ${title}`;
  if (place.dataset.key === key && place.contains(document.activeElement)) return;
  place.dataset.key = key;
  const element = known.elements.find((element) => element.name === type.split("/").at(-1) && element.kind === table.path[0]);
  place.replaceChildren(
    el("h3", {}, title),
    ...(element ? [el("p", {}, element.summary)] : []),
    ...rows.map(([path, node, needed]) => field(view, number, table, path, node, needed, known)),
  );
}

function field(view, number, table, path, node, needed, known) {
  const name = path.join(".");
  const given = table.keys.find((key) => key.path.join(".") === name);
  const type = word(table, "type");
  const choices = words(known.schema, schemaAt(known.schema, [...table.path, ...path], type));
  const plainWords = choices.length && choices.every(([word]) => typeof word === "string" || typeof word === "boolean");
  const id = `field-${name}`;
  const onlyWords = plainWords && !node.anyOf?.some((part) => part.type === "array");
  const control = onlyWords
    ? el("select", { id }, ...[["", ""], ...choices].map(([word]) => el("option", { value: word === "" ? "" : JSON.stringify(word) }, String(word))))
    : el("input", { id, type: "text", spellcheck: false, autocomplete: "off", placeholder: node.default === undefined ? "" : JSON.stringify(node.default) });
  const value = given?.value ?? "";
  control.value = onlyWords ? value.replace(/^'(.*)'$/, '"$1"') : value;
  if (onlyWords && control.value !== value) control.append(el("option", { value, selected: true }, value));
  control.addEventListener("change", () => write(view, number, path, control.value.trim()));
  const about = meaning(node);
  return el("div", { class: "field" }, el("label", { for: id }, name, needed ? el("b", { title: "needed" }, " *") : null), control, about ? el("small", {}, about) : null);
}

/** Writes a value into the text; an empty one takes the key away. */
function write(view, number, path, value) {
  const text = view.state.doc.toString();
  const table = tables(text)[number];
  const name = path.join(".");
  const given = table.keys.find((key) => key.path.join(".") === name);
  const insert = value && toml(value);
  let change;
  if (given && insert) change = { from: given.from, to: given.to, insert };
  else if (given) {
    const line = view.state.doc.lineAt(given.start);
    const end = view.state.doc.lineAt(given.to);
    change = { from: line.from, to: Math.min(end.to + 1, text.length) };
  } else if (insert) {
    const last = table.keys.at(-1);
    const at = last ? view.state.doc.lineAt(last.to).to : Math.max(table.body - 1, 0);
    change = { from: at, insert: `\n${name} = ${insert}` };
  }
  if (change) view.dispatch({ changes: change });
}

/** What people write, as TOML: words get quotation marks. */
function toml(value) {
  const number = /^[+-]?(\d[\d_]*)(\.\d[\d_]*)?([eE][+-]?\d+)?$/.test(value);
  const closed = /^(\[[^]*\]|\{[^]*\}|"[^"\n]*"|'[^'\n]*'|true|false)$/.test(value);
  return number || closed ? value : JSON.stringify(value);
}
