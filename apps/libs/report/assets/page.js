'use strict';
(() => {
  // Where the reader is.
  const links = new Map([...document.querySelectorAll('nav a')].map(a => [a.hash.slice(1), a]));
  const seen = new IntersectionObserver(entries => {
    for (const e of entries) if (links.has(e.target.id)) links.get(e.target.id).classList.toggle('here', e.isIntersecting);
  }, {rootMargin: '-30% 0px -65% 0px'});
  document.querySelectorAll('main > section').forEach(s => seen.observe(s));

  // What stands in <title> shows at once, and under a finger too.
  const tip = document.getElementById('tip');
  for (const title of document.querySelectorAll('.panel svg :not(svg) > title')) {
    title.parentNode.dataset.tip = title.textContent;
    title.remove();
  }
  const showTip = event => {
    const target = event.target.closest && event.target.closest('[data-tip]');
    tip.hidden = !target;
    if (!target) return;
    tip.textContent = target.dataset.tip;
    const x = Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8);
    const y = event.clientY + 18 + tip.offsetHeight > innerHeight ? event.clientY - tip.offsetHeight - 12 : event.clientY + 18;
    tip.style.left = Math.max(8, x) + 'px';
    tip.style.top = y + 'px';
  };
  addEventListener('pointermove', showTip);
  addEventListener('pointerdown', showTip);

  // A picture on its own: looks are written into it, shared parts are copied in.
  const looks = ['fill', 'fill-opacity', 'stroke', 'stroke-width', 'stroke-opacity', 'stroke-dasharray', 'stroke-linejoin',
    'stroke-linecap', 'opacity', 'font-size', 'font-weight', 'font-family', 'text-anchor', 'paint-order', 'filter', 'vector-effect'];
  const standalone = svg => {
    const copy = svg.cloneNode(true);
    const from = [svg, ...svg.querySelectorAll('*')], to = [copy, ...copy.querySelectorAll('*')];
    from.forEach((element, i) => {
      const style = getComputedStyle(element);
      for (const look of looks) {
        const value = style.getPropertyValue(look);
        if (value && value !== 'auto' && value !== 'none' || look === 'fill' || look === 'stroke') to[i].setAttribute(look, value);
      }
      to[i].removeAttribute('class');
      to[i].removeAttribute('style');
      if (element.dataset && element.dataset.tip) {
        const title = document.createElementNS('http://www.w3.org/2000/svg', 'title');
        title.textContent = element.dataset.tip;
        to[i].removeAttribute('data-tip');
        to[i].prepend(title);
      }
    });
    for (const use of copy.querySelectorAll('use')) {
      const source = document.querySelector(use.getAttribute('href'));
      if (!source || copy.contains(copy.querySelector(use.getAttribute('href')))) continue;
      const part = source.cloneNode(true);
      part.removeAttribute('id');
      if (use.getAttribute('opacity')) part.setAttribute('opacity', use.getAttribute('opacity'));
      if (use.getAttribute('filter')) part.setAttribute('style', 'filter:' + use.getAttribute('filter'));
      use.replaceWith(part);
    }
    const [, , width, height] = svg.getAttribute('viewBox').split(/\s+/).map(Number);
    copy.setAttribute('xmlns', 'http://www.w3.org/2000/svg');
    copy.setAttribute('width', width);
    copy.setAttribute('height', height);
    const back = document.createElementNS('http://www.w3.org/2000/svg', 'rect');
    back.setAttribute('width', '100%');
    back.setAttribute('height', '100%');
    back.setAttribute('fill', getComputedStyle(document.body).backgroundColor);
    copy.prepend(back);
    return {text: new XMLSerializer().serializeToString(copy), width, height};
  };
  const download = (blob, name) => {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 5000);
  };
  const saveSvg = panel => download(new Blob([standalone(panel.querySelector('svg')).text], {type: 'image/svg+xml'}), panel.dataset.file + '.svg');
  const savePng = panel => {
    const drawing = panel.querySelector('canvas');
    if (drawing) return drawing.toBlob(blob => download(blob, panel.dataset.file + '.png'));
    const {text, width, height} = standalone(panel.querySelector('svg'));
    const image = new Image();
    image.onload = () => {
      const scale = Math.max(2, 1600 / width);
      const canvas = document.createElement('canvas');
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
      canvas.getContext('2d').drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob(blob => download(blob, panel.dataset.file + '.png'));
    };
    image.src = URL.createObjectURL(new Blob([text], {type: 'image/svg+xml'}));
  };

  const csvOf = table => [...table.rows].map(row => [...row.cells].flatMap(cell => {
    const text = cell.dataset.value || cell.innerText.trim();
    const quoted = /[",\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text;
    return [quoted, ...Array(cell.colSpan - 1).fill('')];
  }).join(',')).join('\n') + '\n';
  const copyCsv = async (table, button) => {
    const text = csvOf(table);
    let done = true;
    try {
      await navigator.clipboard.writeText(text);
    } catch {  // a page from disk may be refused the clipboard
      const area = document.createElement('textarea');
      area.value = text;
      document.body.append(area);
      area.select();
      done = document.execCommand('copy');
      area.remove();
    }
    const words = button.textContent;
    button.textContent = done ? 'Copied' : 'The browser refused';
    setTimeout(() => { button.textContent = words; }, 1500);
  };
  document.addEventListener('click', event => {
    const button = event.target.closest('[data-act]');
    if (!button) return;
    if (button.dataset.act === 'csv') copyCsv(button.closest('.table').querySelector('table'), button);
    if (button.dataset.act === 'svg') saveSvg(button.closest('.panel'));
    if (button.dataset.act === 'png') savePng(button.closest('.panel'));
  });
})();
