/** Show only what has the chosen values: of its own data-…, one word or several. */
function picks() {
  const choices = [...document.querySelectorAll("[data-pick]")];
  if (!choices.length) return;
  const items = [...document.querySelectorAll("[data-role], [data-kinds]")];
  const groups = [...document.querySelectorAll(".picked")]; // each says if it is left empty
  const tell = groups.length ? counter(choices[0].closest(".tools")) : null;
  const none = groups.map((group) => {
    const said = document.createElement("p");
    said.className = "shown none";
    said.textContent = "Nothing fits the choice.";
    group.before(said);
    return said;
  });
  const show = () => {
    items.forEach((item) => {
      item.hidden = !choices.every((choice) => {
        const has = item.dataset[choice.dataset.pick];
        return !choice.value || has === undefined || has.split(" ").includes(choice.value);
      });
    });
    const shown = groups.map((group) => [...group.children].filter((item) => !item.hidden).length);
    none.forEach((said, i) => { said.hidden = shown[i] > 0; });
    const sum = (list) => list.reduce((a, b) => a + b, 0);
    tell?.([[sum(shown), sum(groups.map((group) => group.children.length)), "cards"]]);
  };
  choices.forEach((choice) => choice.addEventListener("change", show));
  show();
}
addEventListener("DOMContentLoaded", picks);
