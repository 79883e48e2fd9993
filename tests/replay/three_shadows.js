// Shadow masks by three.js: a module of the page that three_shadows_test.cpp writes.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

// Each pixel gets the share of light by three's own lookup; how many texels away, along the farther axis, the next change
// of light is (9: none within 3), negative where the receiver is turned away; the depth from the camera; the slopes of the
// receiver's plane in the map, together. The plane is lit or dark at a texel, or neither where the bias decides.
const fragment = (coordinate, map, size, bias) => `
  vec3 at = ${coordinate}.xyz / ${coordinate}.w * vec3(${size}, ${size}, 1);
  vec3 dx = dFdx(at), dy = dFdy(at);
  float det = dx.x * dy.y - dx.y * dy.x;
  vec2 slope = vec2(dx.z * dy.y - dy.z * dx.y, dy.z * dx.x - dx.z * dy.x) / det;
  float steepest = abs(slope.x) + abs(slope.y), least = 0.5 * steepest + 1e-6, own = -1.0, change = 9.0;
  for (int k = 0; k < 49; ++k) {
    int turn = (k + 24) % 49;  // the middle comes first
    vec2 texel = floor(at.xy) + vec2(turn % 7 - 3, turn / 7 - 3), away = texel + 0.5 - at.xy, gap = abs(away) - 0.5;
    float behind = at.z + dot(slope, away) - unpackRGBAToDepth(texture2D(${map}, (texel + 0.5) / float(${size})));
    float state = behind > max(least, float(${bias})) ? 2.0 : behind > least ? 1.0 : 0.0;
    if (k == 0) own = state;
    if (state != own || state == 1.0) change = min(change, max(max(gap.x, gap.y), 0.0));
  }
  gl_FragColor = vec4(getShadowMask(), det > 0.0 ? change : -1.0, 1.0 / gl_FragCoord.w, steepest);`;

const placed = (camera, world) => {
  camera.updateProjectionMatrix();
  camera.matrixWorld.fromArray(world);
  camera.matrixWorldInverse.copy(camera.matrixWorld).invert();
};

// The scene of a glTF text with one light, whose map is drawn through `view`: the columns of its matrix to the world,
// the parameters of an orthographic or a perspective camera, and the map's size.
window.shadowMask = async ({ gltf, width, height, soft, bias, view }) => {
  const { scene } = await new GLTFLoader().parseAsync(gltf, '');
  let camera, light;
  scene.traverse((object) => {
    object.castShadow = object.receiveShadow = true;
    object.frustumCulled = false;
    if (object.isCamera) camera = object;
    if (object.isLight) light = object;
  });
  const directional = light.isDirectionalLight, { shadow } = light;
  const material = new THREE.ShadowMaterial({ transparent: false, blending: THREE.NoBlending, shadowSide: THREE.DoubleSide });
  material.onBeforeCompile = (shader) => {
    const before = shader.fragmentShader;
    shader.fragmentShader = before.replace(/gl_FragColor = .*;/, directional ? fragment('vDirectionalShadowCoord[0]', 'directionalShadowMap[0]', view.size, -bias) : fragment('vSpotLightCoord[0]', 'spotShadowMap[0]', view.size, -bias)).replace(/#include <(tonemapping|colorspace|fog)_fragment>/g, '');
  };
  scene.traverse((object) => {
    if (!object.isMesh) return;
    object.material = material;
    object.geometry.computeVertexNormals();  // shifts by normalBias, which is 0, along them
  });
  camera.aspect = width / height;
  camera.updateProjectionMatrix();

  shadow.mapSize.set(view.size, view.size);
  shadow.bias = bias;
  shadow.camera = directional ? new THREE.OrthographicCamera(-view.half, view.half, view.half, -view.half, view.near, view.far) : new THREE.PerspectiveCamera(THREE.MathUtils.radToDeg(view.fov), 1, view.near, view.far);
  shadow.updateMatrices = () => {
    placed(shadow.camera, view.world);
    shadow.matrix.set(0.5, 0, 0, 0.5, 0, 0.5, 0, 0.5, 0, 0, 0.5, 0.5, 0, 0, 0, 1).multiply(shadow.camera.projectionMatrix).multiply(shadow.camera.matrixWorldInverse);
  };

  const renderer = new THREE.WebGLRenderer({ antialias: false });
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = soft ? THREE.PCFSoftShadowMap : THREE.BasicShadowMap;
  renderer.setClearColor(0, 0);
  const target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType, colorSpace: THREE.NoColorSpace });
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  const pixels = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  renderer.dispose();
  return Array.from(pixels, (value) => (Number.isFinite(value) ? value : 1e30));  // row by row from the bottom
};
// Fractional bits of the places to which the browser's rasterizer rounds vertices.
window.subpixelBits = () => {
  const gl = document.createElement('canvas').getContext('webgl2');
  return gl.getParameter(gl.SUBPIXEL_BITS);
};
document.body.dataset.ready = 'true';
