"use strict";
// One picture at the size of the window. The arrow keys change between expected, actual,
// difference and FLIP in the same place, so that differences are visible. Escape closes.
const dialog = document.querySelector("dialog");
const large = dialog.querySelector("img");
const caption = document.getElementById("caption");
const kinds = dialog.querySelector(".kinds");
let pictures = [];
let current = 0;

function show(index) {
  current = (index + pictures.length) % pictures.length;
  const image = pictures[current].querySelector("img");
  large.src = image.src;
  large.alt = image.alt;
  caption.textContent = `${image.alt} (${current + 1} of ${pictures.length}; arrow keys change)`;
  for (const [place, button] of [...kinds.children].entries()) {
    button.setAttribute("aria-pressed", String(place === current));
  }
  // The focus moves too, so that the outlined button is the pressed one.
  kinds.children[current].focus();
}

function open(button) {
  pictures = [...button.closest(".pictures").querySelectorAll("button")];
  kinds.replaceChildren(...pictures.map((picture, place) => {
    const choice = document.createElement("button");
    choice.type = "button";
    choice.textContent = picture.dataset.kind;
    choice.addEventListener("click", () => show(place));
    return choice;
  }));
  dialog.showModal();
  show(pictures.indexOf(button));
}

for (const button of document.querySelectorAll(".pictures button")) {
  button.addEventListener("click", () => open(button));
}
dialog.addEventListener("keydown", (event) => {
  const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
  if (step) {
    event.preventDefault();
    show(current + step);
  }
});
