// Where things stand in the text of a scene: tables, their keys and values. The solver reads TOML; this only finds places.

/** Tables of a text in their order; the first has no header. Offsets are those of the text. */
export function tables(text) {
  const found = [{ path: [], array: false, from: 0, to: text.length, body: 0, keys: [] }];
  const line = /[^\n]*(?:\n|$)/y;
  for (let at = 0; at < text.length; ) {
    line.lastIndex = at;
    const [row] = line.exec(text);
    const header = /^\s*(\[\[?)\s*([^\]\n]*?)\s*\]/.exec(row);
    const key = /^\s*((?:[\w-]+|"[^"\n]*")(?:\s*\.\s*(?:[\w-]+|"[^"\n]*"))*)\s*=[ \t]*/.exec(row);
    const table = found.at(-1);
    if (header) {
      table.to = at;
      const path = header[2].split(".").map(plain);
      found.push({ path, array: header[1] === "[[", from: at, to: text.length, body: at + row.length, keys: [] });
    } else if (key) {
      const from = at + key[0].length;
      const to = endOfValue(text, from);
      const start = at + row.indexOf(key[1]);
      table.keys.push({ path: key[1].split(".").map(plain), start, from, to, value: text.slice(from, to) });
      line.lastIndex = to;
      at = to + line.exec(text)[0].length;
      continue;
    }
    at += row.length || 1;
  }
  return found;
}

function plain(name) {
  return name.trim().replace(/^"(.*)"$/, "$1");
}

/** The end of the value that begins at a place: of its line, or where its brackets are closed. */
function endOfValue(text, from) {
  let [depth, quote, last] = [0, "", from];
  for (let k = from; k < text.length; k++) {
    const c = text[k];
    if (quote) {
      if (c === "\\" && quote === '"') k++;
      else if (c === quote || c === "\n") quote = "";
      last = k + 1;
      continue;
    }
    const long = ['"""', "'''"].find((mark) => text.startsWith(mark, k));
    if (long) {
      const end = text.indexOf(long, k + 3);
      last = end < 0 ? text.length : end + 3;
      k = last - 1;
      continue;
    }
    if (c === '"' || c === "'") quote = c;
    else if (c === "[" || c === "{") depth++;
    else if (c === "]" || c === "}") depth--;
    else if (c === "#") {
      while (k < text.length && text[k] !== "\n") k++;
      k--;
      continue;
    } else if (c === "\n" && depth <= 0) break;
    if (!/\s/.test(c)) last = Math.min(k + 1, text.length);
  }
  return Math.min(last, text.length);
}

/** The table that a place is in, with its number. */
export function tableAt(all, at) {
  let k = all.length - 1;
  while (k > 0 && all[k].from > at) k--;
  return [all[k], k];
}

/** The text value of a key of a table; empty where it has none. */
export function word(table, ...path) {
  const key = table.keys.find((key) => key.path.join(".") === path.join("."));
  return key ? key.value.replace(/^(["'])(.*)\1$/, "$2") : "";
}

/** Names that tables of some kinds have. */
export function names(all, ...kinds) {
  return all.filter((table) => table.path.length === 1 && kinds.includes(table.path[0])).map((table) => word(table, "name")).filter(Boolean);
}

/** The part of the schema that a path leads to, for a table with these words; `null` where there is none. */
export function schemaAt(schema, path, type) {
  let parts = [schema.root];
  for (const name of path) {
    const found = parts.flatMap((part) => children(schema, part, type).filter(([key]) => key === name));
    // What the type says counts before what is said of all types.
    const own = found.filter(([, node, , ruled]) => ruled && node.properties);
    parts = (own.length ? own : found).map(([, node]) => node);
    parts = parts.flatMap((part) => (part.items && !Array.isArray(part.items) && part.items.properties ? [part.items] : [part]));
  }
  return parts;
}

/** Keys below parts of the schema, as [name, node, required], in the order that the schema wants. */
export function keysOf(schema, parts, type) {
  const found = new Map();
  for (const part of parts) for (const [key, node, needed] of children(schema, part, type)) {
    const known = found.get(key);
    // What a type says of a key comes with what is said of it in general.
    found.set(key, known ? [key, { ...known[1], ...node, description: node.description ?? known[1].description }, known[2] || needed] : [key, node, needed]);
  }
  const order = parts.flatMap((part) => resolve(schema, part)["x-order"] ?? []);
  const place = ([key]) => (order.includes(key) ? order.indexOf(key) : order.length);
  return [...found.values()].sort((a, b) => place(a) - place(b));
}

function children(schema, part, type) {
  const node = resolve(schema, part);
  const own = (node.properties ? Object.entries(node.properties) : []).map(([key, value]) => [key, value, (node.required ?? []).includes(key), false]);
  const rules = (node.allOf ?? []).filter((rule) => applies(rule, type)).flatMap((rule) => children(schema, rule.then ?? rule, type));
  const others = (node.anyOf ?? []).flatMap((other) => children(schema, other, type));
  return [...own, ...others, ...rules.map(([key, value, needed]) => [key, value, needed, true])];
}

function applies(rule, type) {
  if (!rule.if) return true;
  const wanted = rule.if.properties?.type;
  return Boolean(wanted && (wanted.enum ?? [wanted.const]).includes(type));
}

export function resolve(schema, node) {
  let found = node;
  while (found?.$ref) found = found.$ref.split("/").slice(1).reduce((at, name) => at?.[name], schema.root) ?? {};
  return found ?? {};
}

/** Words that a value may be, as [word, description]. */
export function words(schema, parts) {
  return parts.flatMap((part) => {
    const node = resolve(schema, part);
    const own = [
      ...(node.enum ?? []).map((word) => [word, ""]),
      ...(node.const === undefined ? [] : [[node.const, node.description ?? ""]]),
      ...(node.type === "boolean" ? [[true, ""], [false, ""]] : []),
    ];
    return [...own, ...words(schema, [...(node.oneOf ?? []), ...(node.anyOf ?? [])])];
  });
}

/** What a key means, in a sentence. */
export function meaning(node) {
  const about = [node.description ?? ""];
  if (node["x-dimension"]) about.push(`A ${node["x-dimension"]}.`);
  if (node.default !== undefined) about.push(`Left out: ${JSON.stringify(node.default)}.`);
  return about.filter(Boolean).join(" ");
}
