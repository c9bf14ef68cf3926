/* The changes of the scene that a live stream was asked for, so that a broken connection loses none.

A change that names the same fields as an earlier one takes its place: a slider is one change, however long it is
dragged. What was not answered when the connection broke is said again (a partial scene merged twice is the scene
merged once); a new session is told everything that was not refused, in order. */

export class Changes {
  #waiting = new Map();
  #unanswered = new Map();
  #holding = new Map();

  /** Takes a change, a partial scene. */
  ask(partial) {
    put(this.#waiting, partial);
    put(this.#holding, partial);
  }

  /** Returns what is to be sent now, in order; it counts as sent. */
  take() {
    const taken = [...this.#waiting.values()];
    this.#waiting.clear();
    for (const partial of taken) put(this.#unanswered, partial);
    return taken;
  }

  /** Notes that the service took the oldest change that it had not answered. */
  answered() {
    this.#oldest();
  }

  /** Notes that it refused it; returns whether there was one. */
  refused() {
    const oldest = this.#oldest();
    if (oldest && this.#holding.get(oldest[0]) === oldest[1]) this.#holding.delete(oldest[0]);
    return Boolean(oldest);
  }

  /** Prepares for a connection that goes on with the session. */
  resume() {
    this.take();
    this.#waiting = this.#unanswered;
    this.#unanswered = new Map();
  }

  /** Prepares for a session that knows none of the changes. */
  beginAnew() {
    this.#waiting = new Map(this.#holding);
    this.#unanswered = new Map();
  }

  #oldest() {
    const [oldest] = this.#unanswered;
    if (oldest) this.#unanswered.delete(oldest[0]);
    return oldest;
  }
}

/** Puts `partial` last, in the place of one that names the same fields. */
function put(kept, partial) {
  const shape = pathsOf(partial).sort().join("\n");
  kept.delete(shape);
  kept.set(shape, partial);
}

function pathsOf(partial, root = "") {
  return Object.entries(partial).flatMap(([name, value]) => {
    const path = `${root}/${name}`;
    const inner = value && typeof value === "object" && !Array.isArray(value) ? pathsOf(value, path) : [];
    return inner.length ? inner : [path];
  });
}
