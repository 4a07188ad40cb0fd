'use strict';
// What base.css sets a variable to, for what is drawn by a script.
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Light or dark: as the system, the button `theme` or the address says. The event `themechange` tells of a change.
(() => {
  const root = document.documentElement;
  const prefersDark = matchMedia('(prefers-color-scheme: dark)');
  const isDark = () => (root.dataset.theme || (prefersDark.matches ? 'dark' : 'light')) === 'dark';

  const button = document.getElementById('theme');
  const nameButton = () => { button.textContent = isDark() ? 'Light' : 'Dark'; };
  const themeChanged = () => { nameButton(); document.dispatchEvent(new Event('themechange')); };
  button.addEventListener('click', () => {
    root.dataset.theme = isDark() ? 'light' : 'dark';
    themeChanged();
  });
  prefersDark.addEventListener('change', themeChanged);
  if (location.hash === '#dark' || location.hash === '#light') root.dataset.theme = location.hash.slice(1);
  nameButton();
})();
