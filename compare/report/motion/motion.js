(() => {
  const figure = document.getElementById("motion"), part = (name) => figure.querySelector(name);
  const { engines, scenes } = JSON.parse(part("script[type='application/json']").textContent);
  const time = part("input"), play = part("button"), pick = part("select");
  const lines = [[part(":scope > svg .ours")], [part(":scope > svg .case"), part(":scope > svg .theirs")]];
  let scene, timer = null;

  // 0 stands for the picture before, of the second engine 1 for that of the first; null: the run has diverged
  for (const { paths } of scenes)
    for (const path of paths)
      path.forEach((picture, k) => {
        if (picture === 0) path[k] = path[k - 1];
        if (picture === 1) path[k] = paths[0][k];
      });

  const outline = (p, links) =>
    p ? links.map(([i, j]) => `M${p[2 * i]} ${p[2 * i + 1]}L${p[2 * j]} ${p[2 * j + 1]}`).join("") : "";

  function show() {
    const k = Number(time.value), seconds = `${(k * scene.dt).toFixed(2)} s`;
    const gone = engines.filter((_, e) => !scene.paths[e][k]);
    lines.forEach((of, e) => of.forEach((line) => line.setAttribute("d", outline(scene.paths[e][k], scene.links))));
    time.setAttribute("aria-valuetext", seconds);
    const apart = gone.length ? gone.map((name) => `${name}: the run has diverged`).join("; ")
      : `apart in any joint by at most ${scene.apart[k]} ${scene.unit}`;
    part("output").textContent = `t = ${seconds}: ${apart}`;
  }

  function stop() {
    clearInterval(timer);
    timer = null;
    play.textContent = "Play";
  }

  function start() {
    if (Number(time.value) >= time.max) time.value = 0;
    timer = setInterval(() => {
      time.value = Number(time.value) + 1;
      show();
      if (Number(time.value) >= time.max) stop();
    }, scene.pause);
    play.textContent = "Pause";
  }

  function choose(k) {
    stop();
    scene = scenes[k];
    time.max = scene.paths[0].length - 1;
    time.value = scene.still;
    part(".base").setAttribute("d", scene.base);
    part("figcaption span").textContent = scene.seen;
    show();
  }

  const moves = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  play.addEventListener("click", () => (timer === null ? start() : stop()));
  time.addEventListener("input", () => { stop(); show(); });
  pick.addEventListener("change", () => { choose(pick.selectedIndex); if (moves) { time.value = 0; start(); } });
  part(".controls").hidden = false;
  pick.selectedIndex = 0;
  choose(0);
  if (moves)  // once, when it is seen first
    new IntersectionObserver((seen, observer) => {
      if (!seen.some((entry) => entry.isIntersecting)) return;
      observer.disconnect();
      if (timer === null) { time.value = 0; start(); }
    }, { threshold: 0.5 }).observe(figure);
})();
