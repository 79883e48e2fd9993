// node beside.js NPM OUT.webp IMAGE...   the images side by side in one WebP file, written by headless Chromium.
// NPM: a folder where `npm install puppeteer-core` was run. CHROMIUM: the browser (default /usr/bin/chromium).
const fs = require('fs'), path = require('path');
const [npm, target, ...images] = process.argv.slice(2);
const puppeteer = require(path.join(path.resolve(npm), 'node_modules/puppeteer-core'));
const QUALITY = 0.85, GAP = 6;
(async () => {
  const browser = await puppeteer.launch({executablePath: process.env.CHROMIUM || '/usr/bin/chromium', headless: true, args: ['--no-sandbox']});
  const page = await browser.newPage();
  const urls = images.map(file => 'data:image/png;base64,' + fs.readFileSync(file).toString('base64'));
  const url = await page.evaluate(async (urls, quality, gap) => {
    const parts = await Promise.all(urls.map(url => { const image = new Image(); image.src = url; return image.decode().then(() => image); }));
    const canvas = document.createElement('canvas');
    canvas.width = parts.reduce((sum, part) => sum + part.width, gap * (parts.length - 1));
    canvas.height = Math.max(...parts.map(part => part.height));
    const context = canvas.getContext('2d');
    context.fillStyle = '#fff';
    context.fillRect(0, 0, canvas.width, canvas.height);
    let x = 0;
    for (const part of parts) { context.drawImage(part, x, 0); x += part.width + gap; }
    return canvas.toDataURL('image/webp', quality);
  }, urls, QUALITY, GAP);
  fs.writeFileSync(target, Buffer.from(url.split(',')[1], 'base64'));
  await browser.close();
})().catch(error => { console.error(String(error.message || error)); process.exit(1); });
