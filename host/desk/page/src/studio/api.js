// Requests to the program that served this page. The token is in the page's address.

const token = new URLSearchParams(location.search).get("token") ?? "";

/** The program does not answer. */
export class Gone extends Error {}

/** An answer with another status than 200. */
export class Refused extends Error {
  constructor(status, text) {
    super(text);
    this.status = status;
  }
}

async function ask(path, options = {}) {
  let answer;
  try {
    answer = await fetch(path, { ...options, headers: { "X-Odyn-Token": token } });
  } catch {
    throw new Gone("the program does not answer");
  }
  const text = await answer.text();
  if (!answer.ok) throw new Refused(answer.status, text);
  return text;
}

export const get = async (path) => JSON.parse(await ask(path));
export const text = (path) => ask(path);
export const post = async (path, body = "") => JSON.parse(await ask(path, { method: "POST", body }));
