// SPDX-License-Identifier: Apache-2.0
// Moves the edge between two pictures: <div class="wipe"><img><img><input type="range"></div>.
for (const wipe of document.querySelectorAll(".wipe")) {
  const slider = wipe.querySelector("input");
  const show = () => wipe.style.setProperty("--at", `${slider.value}%`);
  slider.addEventListener("input", show);
  show();
}
