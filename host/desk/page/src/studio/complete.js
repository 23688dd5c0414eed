// What may be written at a place, and what is written there means, by the schema of scenes.

import { hoverTooltip } from "@codemirror/view";
import { el } from "../dom.js";
import { keysOf, meaning, names, schemaAt, tableAt, tables, word, words } from "./toml.js";

/** Completion for an editor; `known` has `schema` and `elements` as soon as they are there. */
export function completer(known) {
  return (context) => {
    if (!known.schema) return null;
    const text = context.state.doc.toString();
    const line = context.state.doc.lineAt(context.pos);
    const before = line.text.slice(0, context.pos - line.from);
    const all = tables(text);
    const [table] = tableAt(all, context.pos);
    const key = table.keys.find((key) => key.from <= context.pos && context.pos <= Math.max(key.to, key.from) + 1);
    const header = /^\s*\[\[?[\w.]*$/.exec(before);
    if (header) return headers(known.schema, line.from + before.indexOf("["));
    const type = word(table, "type");
    if (key && !/^\s*[\w.-]*$/.test(before)) return values(context, known, all, table, key, before);
    const typed = /[\w.-]*$/.exec(before)[0];
    if (!typed && !context.explicit) return null;
    const path = typed.split(".").slice(0, -1);
    const parts = schemaAt(known.schema, [...table.path, ...path], type);
    const there = table.keys.map((key) => key.path.join("."));
    const options = keysOf(known.schema, parts, type)
      .filter(([name]) => !there.includes([...path, name].join(".")))
      .map(([name, node, needed]) => ({
        label: name,
        type: "property",
        detail: needed ? "needed" : (node["x-dimension"] ?? ""),
        info: meaning(node) || undefined,
        boost: needed ? 10 : 0,
        apply: node.properties || ["params", "inputs"].includes(name) ? `${name}.` : `${name} = `,
      }));
    return { from: context.pos - typed.length + (path.length ? path.join(".").length + 1 : 0), options, validFor: /^[\w-]*$/ };
  };
}

function headers(schema, from) {
  const list = [];
  const add = (node, path) => {
    for (const [name, child] of Object.entries(node.properties ?? {})) {
      const inner = child.items?.properties ? child.items : child;
      if (!inner.properties && !inner.additionalProperties && !child.$ref) continue;
      const whole = [...path, name].join(".");
      const array = child.type === "array" || Boolean(child.items);
      if (path.length && !array) continue;
      list.push({ label: array ? `[[${whole}]]` : `[${whole}]`, info: child.description, type: "class" });
      if (array && path.length < 1) add(inner, [...path, name]);
    }
  };
  add(schema.root, []);
  return { from, options: list, validFor: /^\[*[\w.]*\]*$/ };
}

/** Names that a key refers to. */
function referred(all, table, key) {
  const name = key.path[0];
  if (name === "bodies" || name === "body" || name === "on") return ["ground", ...names(all, "body")];
  if (name === "joints") return names(all, "joint");
  if (name === "of") return names(all, "body", "joint", "force", "control", "input");
  if (name === "frame") return names(all, "body");
  if (name === "inputs") return names(all, "output", "control", "input");
  return [];
}

function values(context, known, all, table, key, before) {
  const kind = table.path[0];
  let options;
  if (key.path[0] === "type" && ["joint", "force", "control"].includes(kind)) {
    options = known.elements.filter((element) => element.kind === kind).map((element) => ({ label: element.name, info: element.summary, type: "type" }));
  } else if (kind === "plugins" && key.path[0] === "libraries") {
    options = [...new Set(known.elements.map((element) => element.library))].map((label) => ({ label, type: "namespace" }));
  } else {
    const own = words(known.schema, schemaAt(known.schema, [...table.path, ...key.path], word(table, "type")));
    options = [
      ...own.map(([label, info]) => ({ label: String(label), info: info || undefined, type: "enum", bare: typeof label !== "string" })),
      ...referred(all, table, key).map((label) => ({ label, type: "variable" })),
    ];
  }
  if (!options.length) return null;
  // Inside of quotation marks the word alone is written, elsewhere with them.
  const typed = /[\w/.-]*$/.exec(before)[0];
  const quoted = before[before.length - typed.length - 1] === '"';
  if (!quoted && !typed && !context.explicit && !/=\s*$/.test(before)) return null;
  const shown = options.map(({ bare, ...option }) => ({ ...option, apply: quoted || bare ? option.label : `"${option.label}"` }));
  return { from: context.pos - typed.length, options: shown, validFor: /^[\w/.-]*$/ };
}

/** Shows what the key under the pointer means. */
export function meanings(known) {
  return hoverTooltip((view, at) => {
    if (!known.schema) return null;
    const [table] = tableAt(tables(view.state.doc.toString()), at);
    const key = table.keys.find((key) => key.start <= at && at <= key.to);
    if (!key) return null;
    const type = word(table, "type");
    const element = key.path[0] === "type" ? known.elements.find((element) => element.name === type.split("/").at(-1)) : null;
    const parts = keysOf(known.schema, schemaAt(known.schema, [...table.path, ...key.path.slice(0, -1)], type), type);
    const node = parts.find(([name]) => name === key.path.at(-1))?.[1];
    const text = element ? element.summary : node ? meaning(node) : "";
    return text ? { pos: key.start, above: true, create: () => ({ dom: el("div", { class: "tip" }, text) }) } : null;
  });
}
