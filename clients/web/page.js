/* Entry point of the pad page: loads the rest of the page. If that fails, tells the user what to do. */

const loading = document.getElementById("loading");

import("./page/main.js")
  .then(({ begin }) => begin())
  .then(() => loading.remove())
  .catch((problem) => {
    loading.setAttribute("role", "alert");
    loading.textContent =
      problem.name === "ServiceProblem"
        ? `${problem.message} Then reload the page.`
        : "Part of the page did not load. Check that the service is running, then reload the page.";
    if (problem.problem?.status === 401) import("./page/key_form.js").then(({ askForKey }) => askForKey());
    console.error(problem);
  });
