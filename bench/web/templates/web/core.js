"use strict";
// Functions that the page and its worker share: beats, frame constants, the float64 reference, the simulation. Formats,
// addresses, curves and slopes come as JSON from Python. Names and roundings are the same as in `golden` and `sim`.
// All is in one function, because the page also sends the text of this function to its worker.
const blyskCore = () => {
  // Fields of packed beats: `put` writes a code into words that are 0, and `get` reads a code.

  function put(words, base, field, code) {
    const value = code & (field.width < 32 ? (1 << field.width) - 1 : -1);
    const shift = field.offset & 31;
    const at = base + (field.offset >>> 5);
    words[at] |= value << shift;
    if (shift + field.width > 32) words[at + 1] |= value >>> (32 - shift);
  }

  // A field has up to 53 bits.
  function get(words, base, field) {
    let value = 0;
    for (let done = 0; done < field.width; ) {
      const bit = field.offset + done;
      const shift = bit & 31;
      const count = Math.min(32 - shift, field.width - done);
      const part = (words[base + (bit >>> 5)] >>> shift) & (count < 32 ? (1 << count) - 1 : -1);
      value += (part >>> 0) * 2 ** done;
      done += count;
    }
    return field.signed && value >= 2 ** (field.width - 1) ? value - 2 ** field.width : value;
  }

  const decoded = (code, field) => code * 2 ** -field.fraction;

  // Data come compressed by zlib, as base 64.

  async function unpacked(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // Decodes the spans of a view. The bytes are: the numbers of spans, fragments and columns, a column for each field, and
  // a bit for each fragment that tells whether it is visible. A column has the lowest bytes of all codes first.
  function spansOf(bytes, columns) {
    const counts = new DataView(bytes.buffer, bytes.byteOffset);
    const count = counts.getUint32(0, true);
    const fragments = counts.getUint32(4, true);
    const codes = {};
    let at = 12;
    for (const column of columns.slice(0, counts.getUint32(8, true))) {
      const values = new Int32Array(count);
      for (let byte = 0; byte < column.bytes; byte++)
        for (let k = 0; k < count; k++) values[k] |= bytes[at++] << (8 * byte);
      const from = column.from && codes[column.from];
      for (let k = 0; k < count; k++) {
        values[k] -= column.bias;
        if (from) values[k] += from[k];
        else if (column.running && k) values[k] += values[k - 1];
      }
      codes[column.name] = values;
    }
    const visible = new Uint8Array(fragments);
    let shown = 0;
    for (let k = 0; k < fragments; k++) shown += visible[k] = (bytes[at + (k >> 3)] >> (k & 7)) & 1;
    const first = new Int32Array(count + 1);
    for (let k = 0; k < count; k++) first[k + 1] = first[k] + codes.length[k];
    const span = new Int32Array(fragments);
    for (let k = 0; k < count; k++) span.fill(k, first[k], first[k + 1]);
    return { count, fragments, shown, codes, visible, first, span };
  }

  // Albedo: the colour of the surface at a pixel.

  // A texture from its picture, which has codes of sRGB, and from the halves of words that load it, 3 bytes each. Level 0
  // is the picture in linear light. Each texel of a further level is the mean of the texels that it covers.
  function textureOf({ width, height, descriptor }, picture, halves) {
    const levels = [{ width, height, texels: Float64Array.from(picture, (code) => linear(code / 255)) }];
    for (let above = levels[0]; above.width > 1 || above.height > 1; above = levels[levels.length - 1]) {
      const [columns, rows] = [Math.max(above.width >> 1, 1), Math.max(above.height >> 1, 1)];
      const [across, down] = [above.width / columns, above.height / rows];
      const texels = new Float64Array(3 * columns * rows);
      for (let row = 0; row < above.height; row++)
        for (let column = 0; column < above.width; column++)
          for (let c = 0; c < 3; c++) {
            const at = 3 * (Math.floor(row / down) * columns + Math.floor(column / across)) + c;
            texels[at] += above.texels[3 * (row * above.width + column) + c] / (across * down);
          }
      levels.push({ width: columns, height: rows, texels });
    }
    const words = Int32Array.from({ length: halves.length / 3 }, (_, k) =>
      halves[3 * k] | (halves[3 * k + 1] << 8) | (halves[3 * k + 2] << 16),
    );
    return { descriptor, halves: words, levels };
  }

  // Mean of the four texels around a place (u, v) of a level, in texels. The texture repeats its picture.
  function sampled({ width, height, texels }, u, v, found) {
    const [column, row] = [Math.floor(u - 0.5), Math.floor(v - 0.5)];
    const [right, down] = [u - 0.5 - column, v - 0.5 - row];
    found[0] = found[1] = found[2] = 0;
    for (let corner = 0; corner < 4; corner++) {
      const [i, j] = [corner & 1, corner >> 1];
      const share = (i ? right : 1 - right) * (j ? down : 1 - down);
      const at = 3 * (((row + j) & (height - 1)) * width + ((column + i) & (width - 1)));
      for (let c = 0; c < 3; c++) found[c] += share * texels[at + c];
    }
  }

  // Albedo along spans, from the words of their lines: vertex colour times colour of the texture, without any rounding.
  // The returned function of a span and the number of a pixel in it writes to `albedo`.
  function albedoOf({ codes }, { levels }, albedo) {
    const line = (name) => [codes[`attributes.start.${name}`], codes[`attributes.step.${name}`]];
    const [weight, red, green, blue] = ["weight", "colors.0", "colors.1", "colors.2"].map(line);
    const [across, down] = ["coordinates.0", "coordinates.1"].map(line);
    const [exponents, ranges, level] = ["exponent", "range", "level"].map((name) => codes[`attributes.${name}`]);
    const [left, upper] = [0, 1].map((c) => codes[`attributes.base.${c}`]);
    return (span, pixel) => {
      const along = pixel * 2 ** -exponents[span];
      const w = weight[0][span] + along * weight[1][span];
      const attribute = ([start, step]) => (start[span] + along * step[span]) / w;
      const scale = 2 ** ranges[span];
      const place = [left[span] + scale * attribute(across), upper[span] + scale * attribute(down)];
      sampled(levels[level[span]], ...place, albedo);
      albedo[0] *= attribute(red);
      albedo[1] *= attribute(green);
      albedo[2] *= attribute(blue);
    };
  }

  // Albedo of the visible fragments, in the order of the spans.
  function albedosOf(spans, texture) {
    const values = new Float64Array(3 * spans.shown);
    const albedo = [0, 0, 0];
    const along = albedoOf(spans, texture, albedo);
    let at = 0;
    for (let n = 0; n < spans.fragments; n++) {
      if (!spans.visible[n]) continue;
      along(spans.span[n], n - spans.first[spans.span[n]]);
      for (let c = 0; c < 3; c++) values[at++] = albedo[c];
    }
    return values;
  }

  // Unit vectors and the constants of a frame, as `blysk.golden.frame_constants` makes them.

  function normalised(vector) {
    const largest = Math.max(...vector.map(Math.abs));
    if (!largest) return [0, 0, 0];
    const scaled = vector.map((part) => part / largest);
    const length = Math.sqrt(scaled[0] * scaled[0] + scaled[1] * scaled[1] + scaled[2] * scaled[2]);
    return scaled.map((part) => part / length);
  }

  function halfwayVector(direction, viewer) {
    const total = direction.map((part, k) => part + viewer[k]);
    return Math.hypot(...total) > 1e-9 ? normalised(total) : [0, 0, 0];
  }

  // Of the eight points of the grid of codes around a vector, the point whose length is nearest to 1.
  function quantised(vector, one) {
    const low = vector.map((part) => Math.floor(part * one));
    const high = vector.map((part) => Math.ceil(part * one));
    let best = low;
    let smallest = Infinity;
    for (let corner = 0; corner < 8; corner++) {
      const candidate = low.map((code, k) => (corner & (1 << k) ? high[k] : code));
      const miss = Math.abs(candidate[0] ** 2 + candidate[1] ** 2 + candidate[2] ** 2 - one * one);
      if (miss < smallest) [best, smallest] = [candidate, miss];
    }
    return best.map((code) => Math.min(Math.max(code, -one), one));
  }

  // The curve of sRGB, see `golden.reference.transfer`. `encoded` turns linear light into LSB of 8-bit sRGB, not
  // rounded. `linear` turns a code from 0 to 1 into linear light.
  const encoded = (light) => {
    if (light <= 0.0031308) return light <= 0 ? 0 : 255 * 12.92 * light;
    return light >= 1 ? 255 : 255 * (1.055 * light ** (1 / 2.4) - 0.055);
  };
  const linear = (code) => (code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4);

  const colorCode = (intensity, format) => Math.floor(intensity * 255 * 2 ** format.fraction + 0.5);

  // Intensities of the three terms, from the settings of the page.
  function termsOf(settings) {
    return {
      ambient: settings.color.map((part) => settings.ambient * part),
      diffuse: settings.color.map((part, k) => settings.diffuse * part * settings.light[k]),
      specular: settings.light.map((part) => settings.specular * part),
    };
  }

  // Axes of the frame of a light, as in `light_frame`: H is along z, and L and V are in the xz plane. `sine` and
  // `cosine` are of half the angle from L to V.
  function lightFrame(direction, viewer) {
    const dot = (one, other) => one[0] * other[0] + one[1] * other[1] + one[2] * other[2];
    const total = direction.map((part, k) => part + viewer[k]);
    const difference = direction.map((part, k) => part - viewer[k]);
    const [cosine, sine] = [total, difference].map((of) => Math.sqrt(dot(of, of)) / 2);
    const across = (vector, axis) => {
      const along = dot(vector, axis);
      let found = vector.map((part, k) => part - along * axis[k]);
      if (Math.sqrt(dot(found, found)) < 1e-12) {
        const sizes = axis.map(Math.abs);
        const least = sizes.indexOf(Math.min(...sizes));
        found = axis.map((part, k) => (k === least ? 1 : 0) - axis[least] * part);
      }
      return normalised(found);
    };
    const first = normalised(cosine >= sine ? total : difference);
    const second = cosine >= sine ? across(difference, first) : across(total, first);
    const [x, z] = cosine >= sine ? [second, first] : [first, second];
    const y = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]];
    return { x, y, z, sine, cosine };
  }

  // Axes of the named components of vectors, as in `vector_axes` for one light with highlights.
  function vectorAxes(components, { x, y, z, sine, cosine }) {
    const scaled = (factor) => y.map((part) => factor * part);
    const mirrors = components.includes("s0");
    const axes = { x0: x, y0: mirrors ? scaled(cosine) : y, z0: z, s0: scaled(sine) };
    return components.map((name) => axes[name]);
  }

  // Vectors of the spans `from` to `to - 1` in the frame of the light: arrays of the codes of start, step and exponent,
  // rounded as in `SpanVectors.quantise`.
  function vectorsOf(codes, from, to, components, frame, { fraction, margin }) {
    const axes = vectorAxes(components, frame);
    const unit = 2 ** fraction;
    const count = axes.length;
    const found = Array.from({ length: 2 * count + 1 }, () => new Int32Array(to - from));
    const [left, right, step] = [0, 1, 2].map(() => new Float64Array(count));
    const [l, r] = ["left", "right"].map((side) => [0, 1, 2].map((c) => codes[`normal_${side}.${c}`]));
    for (let span = from; span < to; span++) {
      const steps = Math.max(codes.length[span] - 1, 1);
      let largest = 0;
      for (let k = 0; k < count; k++) {
        const axis = axes[k];
        left[k] = l[0][span] * axis[0] + l[1][span] * axis[1] + l[2][span] * axis[2];
        right[k] = r[0][span] * axis[0] + r[1][span] * axis[1] + r[2][span] * axis[2];
        if (codes.length[span] === 1) right[k] = left[k];
        largest = Math.max(largest, Math.abs(left[k]), Math.abs(right[k]));
      }
      if (!(largest > 0)) throw new Error("a span has no vector");
      const scale = (1 - margin / unit) / largest;
      let longest = 2 ** -60;
      for (let k = 0; k < count; k++) {
        step[k] = ((right[k] - left[k]) * scale) / steps;
        longest = Math.max(longest, Math.abs(step[k]));
      }
      const fits = Math.floor(-Math.log2(longest * (1 + 1 / unit)));
      if (fits < 0) throw new Error("the step of a span does not fit");
      const exponent = Math.min(fits, 35 - Math.clz32(steps - 1));
      for (let k = 0; k < count; k++) {
        found[k][span - from] = Math.floor(left[k] * scale * unit + 0.5);
        found[count + k][span - from] = Math.floor(step[k] * 2 ** exponent * unit + 0.5);
      }
      found[2 * count][span - from] = exponent;
    }
    return found;
  }

  function constantsOf(settings, viewer, tables, lobe = null, vectors = null, texture = null) {
    const terms = termsOf(settings);
    const code = (intensities) => intensities.map((part) => colorCode(part, tables.color));
    const direction = normalised(settings.direction);
    const halfway = halfwayVector(direction, viewer);
    const lit = halfway.some((part) => part) || (lobe?.model.mirror ?? false);
    const row = lobe ? lobe.parameters.indexOf(settings[lobe.parameter]) : -1;
    return {
      exponent: [lobe ? lobe.exponents[row] : settings.exponent],
      ambient: code(terms.ambient),
      ...(vectors
        ? { direction: directionCodes(lightFrame(direction, viewer), tables.vector.one), halfway: [0, 0, 0] }
        : { direction: quantised(direction, tables.one), halfway: lit ? quantised(halfway, tables.one) : [0, 0, 0] }),
      diffuse: code(terms.diffuse),
      specular: lit ? code(terms.specular) : [0, 0, 0],
      ...(lobe && { threshold: lobe.thresholds[row], lobe: tableOf(lobe, lobe.parameters[row]) }),
      ...(texture && { emission: [0, 0, 0], texture: texture.descriptor, texels: texture.halves }),
    };
  }

  // Codes of sin a, 0 and cos a, rounded to nearest, and halves to even.
  function directionCodes({ sine, cosine }, one) {
    const nearest = (value) => (value % 1 === 0.5 ? 2 * Math.round(value / 2) : Math.round(value));
    return [nearest(sine * one), 0, nearest(cosine * one)];
  }

  // Entries of a lobe's table, as in `blysk.golden.lighting.lobe`. A table of two parts has its second part from the
  // entry `border`. If the curve falls, no entry is larger than the entry before.
  function tableOf({ model, entries, middles, border }, parameter) {
    const reflect = reflection(model, parameter);
    const value = entries.map(reflect);
    const high = middles.map((cosine, k) => (value[k + 1] + value[k]) / 2 - reflect(cosine));
    const falls = value.every((own, k) => !k || own <= value[k - 1]);
    let least = Infinity;
    return value.map((own, k) => {
      const after = high[Math.min(k, high.length - 1)];
      const before = k === border ? after : high[Math.max(k - 1, 0)];
      const [smaller, larger] = [Math.abs(before), Math.abs(after)].sort((a, b) => a - b);
      const move = before * after > 0 ? Math.sign(before) * Math.min(larger / 2, 2 * smaller) : 0;
      const limited = Math.min(Math.max(own - move, 0), 1 - 2 ** -17);
      const code = Math.floor(limited * 2 ** 17 + 0.5);
      return falls ? (least = Math.min(least, code)) : code;
    });
  }

  // Beats of the write port that write the constants of a frame.
  function writesOf(constants, tables, port) {
    const beats = [];
    const add = (base, values) => values.forEach((value, k) => beats.push([base + k, value]));
    for (const [name, [first]] of Object.entries(tables.frame)) add(first, constants[name]);
    if (constants.lobe) {
      if (constants.threshold !== null) beats.push([tables.threshold, constants.threshold]);
      beats.push([tables.lobe, 1 << 17]);
      for (const value of constants.lobe) beats.push([tables.lobe, value]);
    }
    if (constants.texture) {
      add(tables.emission, constants.emission);
      add(tables.texture, constants.texture);
      beats.push([tables.texels, 0]);
      for (const value of constants.texels) beats.push([tables.texel, value]);
    }
    for (const [name, [first]] of Object.entries(tables.light)) add(tables.stride + first, constants[name]);
    const words = new Uint32Array(beats.length * port.words);
    beats.forEach(([address, data], k) => {
      put(words, k * port.words, port.fields.address, address);
      put(words, k * port.words, port.fields.data, data);
    });
    return { words, count: beats.length };
  }

  // The reference in float64.

  // Highlight as a function of N·H or R·V. `exponent` is the roughness if the model has a roughness.
  function reflection(model, exponent) {
    if (model.kind === "ggx") {
      const alpha = exponent ** 2;
      const width = ((1 - alpha) * (1 + alpha)) / alpha ** 2;
      return (cosine) => (cosine > 0 ? (1 + Math.max((1 - cosine) * (1 + cosine) * width, 0)) ** -2 : 0);
    }
    if (model.kind === "power") return (cosine) => Math.max(cosine, 0) ** exponent;
    if (model.kind === "exp") return (cosine) => Math.exp(exponent * (cosine - 1));
    if (model.kind === "coscos") {
      const scale = model.scales[exponent - 1];
      return (cosine) => {
        const angle = scale * Math.acos(Math.max(cosine, -1));
        return angle < Math.PI / 2 ? Math.cos(angle) ** model.power : 0;
      };
    }
    const slope = model.slopes[exponent - 1];
    return (cosine) => {
      let base = Math.max(slope * (cosine - 1) + 1, 0);
      for (let power = model.power; power > 1; power /= 2) base *= base;
      return base;
    };
  }

  // Normals along a span, from the codes of its ends. The returned function of t writes the normal at t to `normal`.
  // The kind "exact" has the exact, perspective-correct normals of the surface. Components are written out for speed.
  function curveOf(kind, spans, span, one, normal) {
    const { codes } = spans;
    const lx = codes["normal_left.0"][span] / one;
    const ly = codes["normal_left.1"][span] / one;
    const lz = codes["normal_left.2"][span] / one;
    const rx = codes["normal_right.0"][span] / one;
    const ry = codes["normal_right.1"][span] / one;
    const rz = codes["normal_right.2"][span] / one;
    const cosine = lx * rx + ly * ry + lz * rz;
    const opposite = 1 + cosine <= 1e-12;
    if (kind === "quadratic") {
      const share = opposite ? 0 : 1 / Math.sqrt(2 * (1 + cosine));
      const [mx, my, mz] = [(lx + rx) * share, (ly + ry) * share, (lz + rz) * share];
      const [gx, gy, gz] = [2 * (lx + rx - 2 * mx), 2 * (ly + ry - 2 * my), 2 * (lz + rz - 2 * mz)];
      const [px, py, pz] = [4 * mx - 3 * lx - rx, 4 * my - 3 * ly - ry, 4 * mz - 3 * lz - rz];
      return (t) => {
        normal[0] = (gx * t + px) * t + lx;
        normal[1] = (gy * t + py) * t + ly;
        normal[2] = (gz * t + pz) * t + lz;
      };
    }
    if (kind === "slerp" && !opposite) {
      const [sx, sy, sz] = [rx - cosine * lx, ry - cosine * ly, rz - cosine * lz];
      const sine = Math.sqrt(sx * sx + sy * sy + sz * sz);
      const share = sine > 0 ? 1 / sine : 0;
      const angle = Math.atan2(sine, cosine);
      return (t) => {
        const along = Math.cos(t * angle);
        const across = Math.sin(t * angle) * share;
        normal[0] = along * lx + across * sx;
        normal[1] = along * ly + across * sy;
        normal[2] = along * lz + across * sz;
      };
    }
    const ratio = kind === "exact" ? 2 ** (codes.ratio[span] / 2 ** 19) : 1;
    return (t) => {
      normal[0] = (1 - t) * lx + t * ratio * rx;
      normal[1] = (1 - t) * ly + t * ratio * ry;
      normal[2] = (1 - t) * lz + t * ratio * rz;
      if (kind === "linear") return;
      const length = Math.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
      if (length > 0) for (let c = 0; c < 3; c++) normal[c] /= length;
    };
  }

  // The returned function computes, from the normal and the albedo of a pixel: N·L, N·H or R·V, both terms, the light that
  // the albedo multiplies, and the color.
  function shader(settings, viewer, model, chord) {
    const direction = normalised(settings.direction);
    const halfway = halfwayVector(direction, viewer);
    const lit = (model.mirror || halfway.some((part) => part)) && settings.specular > 0;
    const between = direction.reduce((sum, part, k) => sum + part * viewer[k], 0);
    const { ambient, diffuse, specular } = termsOf(settings);
    const reflect = reflection(model, settings[model.parameter ?? "exponent"]);
    const found = { cosine: 0, highlight: 0, diffuse: 0, specular: 0, surface: [0, 0, 0], color: [0, 0, 0] };
    return (normal, albedo = [1, 1, 1]) => {
      found.cosine = normal[0] * direction[0] + normal[1] * direction[1] + normal[2] * direction[2];
      found.highlight = normal[0] * halfway[0] + normal[1] * halfway[1] + normal[2] * halfway[2];
      if (model.mirror) {
        const towards = normal[0] * viewer[0] + normal[1] * viewer[1] + normal[2] * viewer[2];
        found.highlight = 2 * found.cosine * towards - between;
      } else if (chord) {
        const far = [0, 1, 2].reduce((sum, c) => sum + (normal[c] - halfway[c]) ** 2, 0);
        found.highlight = 1 - far / 2;
      }
      found.diffuse = Math.max(found.cosine, 0);
      found.specular = lit && found.cosine > 0 ? reflect(Math.min(found.highlight, 1)) : 0;
      for (let c = 0; c < 3; c++) {
        found.surface[c] = ambient[c] + found.diffuse * diffuse[c];
        found.color[c] = found.surface[c] * albedo[c] + found.specular * specular[c];
      }
      return found;
    };
  }

  // Normals of the visible fragments, in the order of the spans. They do not depend on the light.
  function normalsOf(spans, curve, one) {
    const values = new Float64Array(3 * spans.shown);
    const normal = [0, 0, 0];
    let at = 0;
    for (let span = 0; span < spans.count; span++) {
      const length = spans.codes.length[span];
      const first = spans.first[span];
      let along = null;
      for (let k = 0; k < length; k++) {
        if (!spans.visible[first + k]) continue;
        along ??= curveOf(curve, spans, span, one, normal);
        along(k / Math.max(length - 1, 1));
        values[at++] = normal[0];
        values[at++] = normal[1];
        values[at++] = normal[2];
      }
    }
    return values;
  }

  // Channels of the visible fragments in LSB of sRGB, in the order of the spans, not rounded. The formulas are those of
  // `shader`, in one loop for speed. Without `albedos` the albedo is 1.
  function reference(normals, settings, viewer, model, chord, albedos = null) {
    const values = new Float64Array(normals.length);
    const [lx, ly, lz] = normalised(settings.direction);
    const halfway = halfwayVector([lx, ly, lz], viewer);
    const [hx, hy, hz] = halfway;
    const lit = (model.mirror || halfway.some((part) => part)) && settings.specular > 0;
    const [vx, vy, vz] = viewer;
    const between = lx * vx + ly * vy + lz * vz;
    const { ambient, diffuse, specular } = termsOf(settings);
    const reflect = reflection(model, settings[model.parameter ?? "exponent"]);
    for (let at = 0; at < normals.length; at += 3) {
      const x = normals[at];
      const y = normals[at + 1];
      const z = normals[at + 2];
      const cosine = x * lx + y * ly + z * lz;
      let shine = 0;
      if (lit && cosine > 0) {
        let highlight = x * hx + y * hy + z * hz;
        if (model.mirror) highlight = 2 * cosine * (x * vx + y * vy + z * vz) - between;
        else if (chord) highlight = 1 - ((x - hx) * (x - hx) + (y - hy) * (y - hy) + (z - hz) * (z - hz)) / 2;
        shine = reflect(highlight < 1 ? highlight : 1);
      }
      const front = cosine > 0 ? cosine : 0;
      for (let c = 0; c < 3; c++) {
        const surface = ambient[c] + front * diffuse[c];
        values[at + c] = encoded((albedos ? albedos[at + c] * surface : surface) + shine * specular[c]);
      }
    }
    return values;
  }

  // The largest error, and the 99.9th percentile. The percentile is interpolated linearly between two errors.
  function errorFigures(errors) {
    const count = errors.length;
    if (!count) return { largest: NaN, p999: NaN };
    const scale = 16;
    const buckets = new Uint32Array(256 * scale + 1);
    for (let k = 0; k < count; k++) buckets[(errors[k] * scale) | 0]++;
    const rank = 0.999 * (count - 1);
    let above = count;
    let bucket = buckets.length;
    while (above > Math.floor(rank)) above -= buckets[--bucket];
    const top = new Float64Array(count - above);
    for (let k = 0, n = 0; k < count; k++) if (errors[k] * scale >= bucket) top[n++] = errors[k];
    top.sort();
    const at = Math.floor(rank) - above;
    const low = top[at];
    const high = top[Math.min(at + 1, top.length - 1)];
    return { largest: top[top.length - 1], p999: low + (rank - Math.floor(rank)) * (high - low) };
  }

  // An instance of a module with the spans of a view.
  class Simulation {
    constructor(module, design, tables) {
      this.exports = new WebAssembly.Instance(module, {}).exports;
      this.design = design;
      this.tables = tables;
    }

    reserve(bytes) {
      return this.exports.reserve(Math.max(bytes, 4));
    }

    words(at, count) {
      return new Uint32Array(this.exports.memory.buffer, at, count);
    }

    // Packs the spans `from` to `to - 1` as input beats. A trace needs only a few spans. A design with an albedo needs a
    // texture.
    load(spans, texture = null, from = 0, to = spans.count) {
      const port = this.design.ports.i;
      this.exports.release();
      this.spans = spans;
      this.texture = texture;
      this.texels = texture ? texture.halves.length : 0;
      this.from = from;
      this.count = to - from;
      this.fragments = spans.first[to] - spans.first[from];
      this.input = this.reserve(this.count * port.words * 4);
      this.output = this.reserve(this.fragments * this.design.ports.o.words * 4);
      this.cycles = this.reserve(this.fragments * 8);
      this.inputClocks = this.reserve(this.count * 8);
      this.writes = this.reserve(4 * this.design.ports.write.words * (1024 + this.texels));
      const words = this.words(this.input, this.count * port.words).fill(0);
      for (const [name, field] of Object.entries(port.fields))
        if (spans.codes[name])
          for (let k = 0; k < this.count; k++) put(words, k * port.words, field, spans.codes[name][from + k]);
      // The vectors depend on the light, so `turn` adds them for each frame.
      this.plain = this.design.vectors && words.slice();
    }

    turn(settings, viewer) {
      const port = this.design.ports.i;
      const words = this.words(this.input, this.count * port.words);
      words.set(this.plain);
      const { spans, from, design, tables } = this;
      const frame = lightFrame(normalised(settings.direction), viewer);
      const found = vectorsOf(spans.codes, from, from + this.count, design.vectors, frame, tables.vector);
      const names = ["start", "step"].flatMap((name) => design.vectors.map((_, k) => `${name}.${k}`));
      [...names, "exponent"].forEach((name, n) => {
        for (let k = 0; k < this.count; k++) put(words, k * port.words, port.fields[name], found[n][k]);
      });
    }

    prepare(settings, viewer) {
      if (this.plain) this.turn(settings, viewer);
      const constants = constantsOf(settings, viewer, this.tables, this.design.lobe, this.design.vectors, this.texture);
      const { words, count } = writesOf(constants, this.tables, this.design.ports.write);
      this.words(this.writes, words.length).set(words);
      this.exports.prepare(
        ...[this.writes, count, this.input, this.count, this.output, this.fragments, this.cycles, this.inputClocks],
      );
    }

    // Simulates a frame. `words` are the output beats in order of pixels. `each` has the cycle of each output beat.
    run(settings, viewer) {
      this.prepare(settings, viewer);
      const end = this.exports.run();
      if (end !== this.tables.done) throw new Error(`the simulation ends with ${end}`);
      const words = this.words(this.output, this.fragments * this.design.ports.o.words);
      const status = this.words(this.exports.status(), this.design.ports.status.words);
      const figure = (name) => get(status, 0, this.design.ports.status.fields[name]);
      return {
        words,
        cycles: this.exports.cycles(),
        gated: "gated" in this.design.ports.status.fields ? figure("gated_pixels") : null,
        wide: figure("out_of_range_spans"),
        each: this.words(this.cycles, 2 * this.fragments),
      };
    }

    // Simulates the spans, and returns the status after each cycle, and the cycles on which spans went in and pixels
    // came out.
    trace(settings, viewer) {
      const size = this.design.ports.status.words;
      const limit = 4096 + this.texels;
      const rows = this.reserve(4 * size * limit);
      const ended = this.reserve(4);
      this.prepare(settings, viewer);
      const count = this.exports.trace(rows, limit, ended);
      if (this.words(ended, 1)[0] !== this.tables.done) throw new Error("the trace does not end");
      const low = (at, of) => Array.from({ length: of }, (_, k) => this.words(at, 2 * of)[2 * k]);
      return {
        rows: this.words(rows, count * size).slice(),
        size,
        count,
        inputClocks: low(this.inputClocks, this.count),
        cycles: low(this.cycles, this.fragments),
        output: this.words(this.output, this.fragments * this.design.ports.o.words).slice(),
      };
    }
  }

  return {
    ...{ put, get, decoded, unpacked, spansOf, textureOf, albedoOf, albedosOf, normalised, halfwayVector, quantised, termsOf, constantsOf, writesOf },
    ...{ encoded, linear, lightFrame, vectorsOf, reflection, tableOf, curveOf, normalsOf, shader, reference, errorFigures, Simulation },
  };
};
