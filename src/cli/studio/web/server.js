// Questions to the program: each carries the token that only the opened address holds.

const given = new URLSearchParams(location.search).get("token");
if (given) {
  sessionStorage.setItem("token", given);
  // Not in the history, not in a screenshot.
  history.replaceState(null, "", "/");
}
const token = sessionStorage.getItem("token") ?? "";

async function ask(path, body, signal) {
  const init = { headers: { "X-Overcoat-Token": token }, signal };
  if (body !== undefined) {
    init.method = "POST";
    init.headers["Content-Type"] = "application/json";
    init.body = JSON.stringify(body);
  }
  const response = await fetch(path, init);
  if (response.ok) return response;
  const { error } = await response.json().catch(() => ({ error: response.statusText }));
  throw Object.assign(new Error(error), { status: response.status });
}

/** One JSON document. */
export async function json(path, body, signal) {
  return (await ask(path, body, signal)).json();
}

/** Calls `each(message, bytes)` for every message of an answer, as it arrives. */
export async function stream(path, body, each, signal) {
  const reader = (await ask(path, body, signal)).body.getReader();
  let waiting = new Uint8Array(0);
  const decoder = new TextDecoder();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    const joined = new Uint8Array(waiting.length + value.length);
    joined.set(waiting);
    joined.set(value, waiting.length);
    waiting = joined;
    while (waiting.length >= 8) {
      const lengths = new DataView(waiting.buffer, waiting.byteOffset);
      const [head, bytes] = [lengths.getUint32(0, true), lengths.getUint32(4, true)];
      if (waiting.length < 8 + head + bytes) break;
      const message = JSON.parse(decoder.decode(waiting.subarray(8, 8 + head)));
      each(message, waiting.slice(8 + head, 8 + head + bytes));
      waiting = waiting.slice(8 + head + bytes);
    }
  }
}

/**
 * A question that is asked again and again while its answer is under way: the newest replaces the one before, but not
 * before that had its first result, so that something is seen while a slider moves.
 */
export class Latest {
  constructor(path, each, failed, ended) {
    Object.assign(this, { path, each, failed, ended });
    this.under = null;
    this.next = null;
  }

  ask(body) {
    if (this.under && !this.under.useful) {
      this.next = body;
      return;
    }
    this.stop();
    this.start(body);
  }

  stop() {
    this.under?.abort.abort();
    this.under = null;
    this.next = null;
  }

  async start(body) {
    const under = { abort: new AbortController(), useful: false };
    this.under = under;
    try {
      await stream(this.path, body, (message, bytes) => {
        if (this.under !== under) return;
        if (this.each(message, bytes) !== false) under.useful = true;
        if (under.useful && this.next) this.follow();
      }, under.abort.signal);
      if (this.under === under) this.ended?.();
    } catch (error) {
      if (this.under === under) this.failed(error);
    }
    if (this.under === under) {
      this.under = null;
      if (this.next) this.follow();
    }
  }

  follow() {
    const body = this.next;
    this.stop();
    this.start(body);
  }
}
