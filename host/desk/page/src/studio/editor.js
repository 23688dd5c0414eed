// The editor of the scene's text.

import { autocompletion, closeBrackets, closeBracketsKeymap, completionKeymap } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap } from "@codemirror/commands";
import { HighlightStyle, StreamLanguage, bracketMatching, syntaxHighlighting } from "@codemirror/language";
import { toml } from "@codemirror/legacy-modes/mode/toml";
import { lintGutter, lintKeymap, setDiagnostics } from "@codemirror/lint";
import { highlightSelectionMatches, search, searchKeymap } from "@codemirror/search";
import { EditorState } from "@codemirror/state";
import { EditorView, drawSelection, highlightActiveLine, highlightActiveLineGutter, keymap, lineNumbers } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import { el } from "../dom.js";
import { completer, meanings } from "./complete.js";

/** A colour of the page, legible on the line of the cursor, too. */
const tone = (name) => `color-mix(in srgb, var(--${name}) 75%, var(--ink))`;

const COLORS = HighlightStyle.define([
  { tag: tags.comment, color: tone("quiet"), fontStyle: "italic" },
  { tag: tags.string, color: tone("good") },
  { tag: [tags.number, tags.bool, tags.atom], color: tone("curve-2") },
  { tag: [tags.propertyName, tags.definition(tags.propertyName)], color: tone("link") },
  { tag: [tags.heading, tags.typeName, tags.className], color: tone("curve-4"), fontWeight: "bold" },
]);

const LOOK = EditorView.theme({
  "&": { height: "100%", fontSize: "14px", backgroundColor: "var(--paper)", color: "var(--ink)" },
  ".cm-scroller": { fontFamily: "ui-monospace, monospace", lineHeight: "1.45" },
  ".cm-gutters": { backgroundColor: "var(--faint)", color: "var(--quiet)", borderRight: "1px solid var(--line)" },
  ".cm-activeLine": { backgroundColor: "color-mix(in srgb, var(--link) 8%, transparent)" },
  ".cm-activeLineGutter": { backgroundColor: "var(--line)", color: "var(--ink)" },
  "&.cm-focused .cm-cursor": { borderLeftColor: "var(--ink)" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": { background: "color-mix(in srgb, var(--link) 30%, transparent)" },
  ".cm-tooltip": { backgroundColor: "var(--faint)", color: "var(--ink)", border: "1px solid var(--line)", maxWidth: "34rem" },
  ".cm-tooltip-autocomplete > ul > li[aria-selected]": { backgroundColor: "var(--link)", color: "var(--paper)" },
  ".cm-panels": { backgroundColor: "var(--faint)", color: "var(--ink)" },
});

/** An editor in a place; `handlers` are called when the text or the cursor changes, to save and to run. */
export function editor(place, text, known, handlers) {
  return new EditorView({
    parent: place,
    state: EditorState.create({
      doc: text,
      extensions: [
        lineNumbers(),
        highlightActiveLine(),
        highlightActiveLineGutter(),
        drawSelection(),
        history(),
        bracketMatching(),
        closeBrackets(),
        search({ top: true }),
        highlightSelectionMatches(),
        StreamLanguage.define(toml),
        syntaxHighlighting(COLORS),
        autocompletion({ override: [completer(known)] }),
        meanings(known),
        lintGutter(),
        LOOK,
        EditorView.lineWrapping,
        EditorView.contentAttributes.of({ "aria-label": "Text of the scene", tabindex: "0" }),
        // Tab leaves the editor, as people who use the keyboard expect of a page.
        keymap.of([
          { key: "Mod-s", run: () => (handlers.save(), true) },
          { key: "Mod-Enter", run: () => (handlers.run(), true) },
          ...closeBracketsKeymap,
          ...defaultKeymap,
          ...searchKeymap,
          ...historyKeymap,
          ...completionKeymap,
          ...lintKeymap,
        ]),
        EditorView.updateListener.of((update) => {
          if (update.docChanged) handlers.changed();
          if (update.docChanged || update.selectionSet) handlers.moved();
        }),
      ],
    }),
  });
}

/** Puts messages at their places. */
export function annotate(view, messages) {
  const length = view.state.doc.length;
  const marks = messages
    .filter((message) => message.line !== null)
    .map((message) => {
      const from = Math.min(message.from, length);
      const to = Math.min(Math.max(message.to, from), length);
      return {
        from,
        to,
        severity: { error: "error", warning: "warning" }[message.severity] ?? "info",
        source: message.code,
        message: message.message,
        renderMessage: () => details(message),
      };
    });
  view.dispatch(setDiagnostics(view.state, marks));
}

/** A message with what helps against it. */
export function details(message) {
  return el(
    "div",
    {},
    el("b", {}, message.message),
    message.label ? el("div", {}, message.label) : null,
    ...message.help.map((text) => el("div", { class: "small" }, `help: ${text}`)),
  );
}

/** Goes to a place of the text. */
export function go(view, at) {
  const anchor = Math.min(at, view.state.doc.length);
  view.dispatch({ selection: { anchor }, effects: EditorView.scrollIntoView(anchor, { y: "center" }) });
  view.focus();
}

/** Replaces the whole text, as one step that can be undone. */
export function replace(view, text) {
  view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: text } });
}
