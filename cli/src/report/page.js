"use strict";
const slider = document.getElementById("moment");
if (slider) {
  const frames = JSON.parse(document.getElementById("frames").textContent);
  const picture = document.getElementById("picture");
  const said = document.getElementById("said");
  const play = document.getElementById("play");
  const show = () => {
    const frame = frames[Number(slider.value)];
    picture.src = "data:image/png;base64," + frame.png;
    picture.alt = "The scene at t = " + frame.time + " s";
    said.value = "t = " + frame.time + " s";
    slider.setAttribute("aria-valuetext", frame.time + " seconds");
  };
  slider.addEventListener("input", show);
  let clock = 0;
  const halt = () => { clearInterval(clock); clock = 0; play.textContent = "Play"; };
  play.addEventListener("click", () => {
    if (clock) { halt(); return; }
    if (Number(slider.value) === frames.length - 1) { slider.value = "0"; }
    play.textContent = "Pause";
    clock = setInterval(() => {
      slider.value = String(Number(slider.value) + 1);
      show();
      if (Number(slider.value) === frames.length - 1) { halt(); }
    }, 250);
  });
  play.hidden = false;
  show();
}
