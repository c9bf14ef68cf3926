/* Entry point of the pad page: loads the rest of the page. If that fails, tells the user what to do. */

const loading = document.getElementById("loading");

import("./page/main.js")
  .then(({ begin }) => begin())
  .then(() => loading.remove())
  .catch((problem) => {
    loading.setAttribute("role", "alert");
    loading.textContent = "Part of the page did not load. Check that the service is running, then reload the page.";
    if (problem.name === "ServiceProblem")
      import("./page/status_texts.js").then(({ LOADING_FAILS, pictureStatusOf }) => {
        loading.textContent = LOADING_FAILS[pictureStatusOf(problem.problem)] ?? problem.message;
      });
    if (problem.problem?.status === 401) import("./page/key_form.js").then(({ askForKey }) => askForKey());
    else if (problem.name !== "ServiceProblem") console.error(problem);
  });
