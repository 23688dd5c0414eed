// Some systems report a language that Intl refuses (`en-US@posix`), and uPlot asks for it while it loads: to be imported first.
try {
  new Intl.NumberFormat(navigator.language);
} catch {
  Object.defineProperty(navigator, "language", { value: "en", configurable: true });
}
