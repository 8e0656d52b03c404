"use strict";
// A surface seen from above and aside, illuminated from the direction of incidence, with the shadows
// that its facets cast. Heights are those of shipped tiles: those of roughness σ are σ times
// those of roughness 1, and between two γ they are mixed.

const relief = (() => {
  const TURN = -0.5, RISE = 0.62; // of the eye, in radians: about z, and above the plane

  function decoded(text, scale) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return Float32Array.from(new Int16Array(bytes.buffer), (v) => v * scale);
  }

  // Heights in cells, row by row.
  function heights(tiles, gamma, sigma) {
    const at = (g) => Math.log(g - 1.5);
    let k = 1;
    while (k < tiles.length - 1 && tiles[k].gamma < gamma) k++;
    const [low, high] = [tiles[k - 1], tiles[k]];
    const span = at(high.gamma) - at(low.gamma);
    const part = Math.min(1, Math.max(0, (at(gamma) - at(low.gamma)) / span));
    low.heights ??= decoded(low.data, low.scale);
    high.heights ??= decoded(high.data, high.scale);
    return low.heights.map((h, j) => sigma * ((1 - part) * h + part * high.heights[j]));
  }

  // Whether light from +x at θ reaches each point; the tile repeats.
  function illuminated(z, side, theta) {
    const climb = 1 / Math.tan((Math.max(theta, 0.01) * Math.PI) / 180);
    return z.map((height, j) => {
      const row = j - (j % side), x = j % side;
      for (let step = 1; step < side; step++) {
        if (z[row + ((x + step) % side)] > height + climb * step + 1e-6) return 0;
      }
      return 1;
    });
  }

  function draw(canvas, tiles, side, settings) {
    const z = heights(tiles, settings.gamma, settings.sigma);
    const light = illuminated(z, side, settings.theta);
    const theta = (settings.theta * Math.PI) / 180;
    const [c, s] = [Math.cos(TURN), Math.sin(TURN)], [up, in_] = [Math.cos(RISE), Math.sin(RISE)];
    const points = Array.from(z, (h, j) => {
      const x = (j % side) - side / 2, y = Math.floor(j / side) - side / 2;
      const depth = s * x + c * y;
      return { x: c * x - s * y, y: -(up * h + in_ * depth), depth };
    });
    const [left, right] = [Math.min, Math.max].map((f) => points.reduce((m, p) => f(m, p.x), 0));
    const [top, bottom] = [Math.min, Math.max].map((f) => points.reduce((m, p) => f(m, p.y), 0));
    const width = canvas.width, height = canvas.height;
    // All of it, unless spikes would leave nothing of the rest: then the frame cuts them.
    const across = width / (right - left);
    const scale = Math.max(0.96 * Math.min(across, height / (bottom - top)), 0.45 * across);
    const middle = (bottom - top) * scale < height ? (top + bottom) / 2 : 0;
    const screenX = (p) => width / 2 + scale * (p.x - (left + right) / 2);
    const screenY = (p) => height / 2 + scale * (p.y - middle);

    const facets = [];
    for (let row = 0; row < side - 1; row++) {
      for (let column = 0; column < side - 1; column++) {
        const j = row * side + column, corners = [j, j + 1, j + side, j + side + 1];
        const [h00, h10, h01, h11] = corners.map((k) => z[k]);
        for (const [use, p, q] of [
          [[corners[0], corners[1], corners[3]], h10 - h00, h11 - h10],
          [[corners[0], corners[3], corners[2]], h11 - h01, h01 - h00],
        ]) {
          const cosine = (-p * Math.sin(theta) + Math.cos(theta)) / Math.hypot(1, p, q);
          const direct = use.reduce((sum, k) => sum + light[k] / 3, 0) * Math.max(0, cosine);
          facets.push({ use, shade: 0.1 + 0.9 * direct, depth: points[j].depth });
        }
      }
    }
    facets.sort((a, b) => b.depth - a.depth);
    const pen = canvas.getContext("2d");
    pen.clearRect(0, 0, width, height);
    for (const { use, shade } of facets) {
      const grey = 255 * Math.min(1, shade) ** (1 / 2.2);
      pen.fillStyle = pen.strokeStyle = `rgb(${0.9 * grey} ${0.95 * grey} ${grey})`;
      pen.beginPath();
      use.forEach((k) => pen.lineTo(screenX(points[k]), screenY(points[k])));
      pen.closePath();
      pen.fill();
      pen.stroke();
    }
    return { lowest: z.reduce((a, b) => Math.min(a, b)), highest: z.reduce((a, b) => Math.max(a, b)) };
  }

  return { draw, heights };
})();
