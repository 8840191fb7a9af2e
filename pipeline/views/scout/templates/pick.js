/** Show only what has the chosen values: of its own data-…, one word or several. */
function picks() {
  const choices = [...document.querySelectorAll("[data-pick]")];
  const items = [...document.querySelectorAll("[data-role], [data-kinds]")];
  const show = () => items.forEach((item) => {
    item.hidden = !choices.every((choice) => {
      const has = item.dataset[choice.dataset.pick];
      return !choice.value || has === undefined || has.split(" ").includes(choice.value);
    });
  });
  choices.forEach((choice) => choice.addEventListener("change", show));
  show();
}
addEventListener("DOMContentLoaded", picks);
