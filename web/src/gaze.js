// Where the page looks, so that bsp2 sends what is to be seen as finely as can be seen, and no finer.
import * as THREE from 'three';

const pause = 120; // milliseconds between two that are told
const most = 2000; // names of each kind in a message

/** @param picks what is selected: that is wanted as it is, since it is measured. */
export function gazeOf(stage, picks) {
  const { camera, look, clips, box } = stage;
  stage.fitDepth();
  camera.updateMatrixWorld();
  const matrix = new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).elements;
  const exactly = (kind) => [...new Set(picks.filter(({ item, kind: picked }) => picked !== 'section' && item.kind === kind && Number.isInteger(item.number)).map(({ item }) => item.number))];
  return {
    matrix: [...matrix], height: stage.renderer.getDrawingBufferSize(new THREE.Vector2()).y, surface: stage.wantsSurface,
    explode: box.isEmpty() ? 0 : look.explode, middle: box.isEmpty() ? [0, 0, 0] : box.getCenter(new THREE.Vector3()).toArray(),
    planes: clips.flatMap(({ plane, place }, axis) => (plane ? [[axis, place, plane.normal.getComponent(axis)]] : [])),
    hidden: [...stage.hidden].slice(0, most), pieces: exactly('piece').slice(0, most), regions: exactly('region').slice(0, most),
  };
}

/** Tells bsp2 when it has changed, not too often. */
export class Gaze {
  constructor(of, say) {
    this.of = of;
    this.say = say;
    this.forget();
  }

  /** Of another connection. */
  forget() {
    clearTimeout(this.waits);
    Object.assign(this, { told: '', number: this.number ?? 0, seen: 0, waits: 0 });
  }

  tell() {
    clearTimeout(this.waits);
    this.waits = 0;
    const gaze = this.of();
    const text = JSON.stringify(gaze);
    if (text === this.told) return;
    this.told = text;
    this.number += 1;
    this.say({ gaze: this.number, ...gaze });
  }

  tellSoon() { if (this.waits === 0 && this.told !== '') this.waits = setTimeout(() => this.tell(), pause); }

  /** Whether all is there that can be seen from where the page looks. */
  get isSatisfied() { return this.told === JSON.stringify(this.of()) && this.seen === this.number; }
}
