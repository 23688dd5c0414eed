// Elements of the page. Texts are set as texts: names of scenes are never HTML.

/** An element with attributes and children; strings become texts. */
export function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === false || value === undefined) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name in element && typeof value !== "string") element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

let last = 0;

/** A control with its label before it. */
export function labelled(text, control) {
  control.id ||= `control-${++last}`;
  return el("span", { class: "control" }, el("label", { for: control.id }, text), control);
}

/** A box to tick with its label behind it. */
export function tick(text, on, change) {
  const box = el("input", { type: "checkbox", checked: on, id: `control-${++last}` });
  box.addEventListener("change", () => change(box.checked));
  return el("span", { class: "control" }, box, el("label", { for: box.id }, text));
}

/** A list to choose from; entries are [value, text]. */
export function choice(text, entries, chosen, change) {
  const list = el("select", {}, ...entries.map(([value, words]) => el("option", { value }, words)));
  list.value = chosen;
  list.addEventListener("change", () => change(list.value));
  return labelled(text, list);
}

/** Hands a blob over as a file. */
export function download(name, blob) {
  const link = el("a", { download: name, href: URL.createObjectURL(blob) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/** What a name of the style sheet stands for now. */
export function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
