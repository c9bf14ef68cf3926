/* The changes of the scene that were requested from a live stream, so that a broken connection loses none.

Model: a change replaces an earlier change of the same fields. After a break, changes without an answer are sent again:
merging a partial scene twice has the effect of merging it once. A new session receives all changes that were not
refused, in order. */

export class SceneChanges {
  #waiting = new Map();
  #unanswered = new Map();
  #accepted = new Map();

  /** Adds a change, a partial scene. */
  add(partial) {
    put(this.#waiting, partial);
    put(this.#accepted, partial);
  }

  /** Returns the changes to send now, in order, and marks them as sent. */
  take() {
    const taken = [...this.#waiting.values()];
    this.#waiting.clear();
    for (const partial of taken) put(this.#unanswered, partial);
    return taken;
  }

  /** Notes that the service applied the oldest change without an answer. */
  answered() {
    this.#oldest();
  }

  /** Notes that the service refused the oldest change without an answer; returns whether there was one. */
  refused() {
    const oldest = this.#oldest();
    if (oldest && this.#accepted.get(oldest[0]) === oldest[1]) this.#accepted.delete(oldest[0]);
    return Boolean(oldest);
  }

  /** Prepares for a connection that resumes the session. */
  resume() {
    this.take();
    this.#waiting = this.#unanswered;
    this.#unanswered = new Map();
  }

  /** Prepares for a new session. */
  restart() {
    this.#waiting = new Map(this.#accepted);
    this.#unanswered = new Map();
  }

  #oldest() {
    const [oldest] = this.#unanswered;
    if (oldest) this.#unanswered.delete(oldest[0]);
    return oldest;
  }
}

/** Appends `partial` and removes an earlier change of the same fields. */
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
