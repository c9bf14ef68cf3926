/* Entry point of the pad page: loads the rest of the page. If that fails, tells the user what to do. */

const NOT_LOADED = "Part of the page did not load. Check that the service is running, then reload the page.";
const loading = document.getElementById("loading");
const tell = (sentence) => {
  loading.textContent = sentence;
};

import("./page/main.js")
  .then(({ begin }) => begin())
  .then(() => loading.remove())
  .catch((problem) => {
    loading.setAttribute("role", "alert");
    tell(NOT_LOADED);
    if (problem.problem?.status === 401)
      import("./page/key_form.js").then(
        ({ askForKey }) => askForKey(),
        () => tell(NOT_LOADED),
      );
    else if (problem.name === "ServiceProblem")
      import("./page/status_texts.js").then(
        ({ LOADING_FAILS, pictureStatusOf }) =>
          tell(LOADING_FAILS[pictureStatusOf(problem.problem)] ?? problem.problem.detail ?? NOT_LOADED),
        () => tell(problem.problem.detail ?? NOT_LOADED),
      );
    else console.error(problem);
  });
