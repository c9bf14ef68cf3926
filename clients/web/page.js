/* The pad page begins here: it loads the rest, and says in one sentence what to do where that fails. */

const loading = document.getElementById("loading");

import("./page/main.js")
  .then(({ begin }) => begin())
  .then(() => loading.remove())
  .catch((problem) => {
    loading.setAttribute("role", "alert");
    loading.textContent =
      problem.name === "ServiceProblem"
        ? `${problem.message} Reload the page when that is done.`
        : "A part of the page did not load: see that the service runs, then reload the page.";
    if (problem.problem?.status === 401) import("./page/key.js").then(({ askForKey }) => askForKey());
    console.error(problem);
  });
