// The page begins here.

document.body.addEventListener("dragover", (event) => event.preventDefault());
document.body.addEventListener("drop", async (event) => {
  event.preventDefault();
  const file = event.dataTransfer.files[0];
  if (file && state.scene) await opened(file);
});

// A picture that cannot be seen need not be drawn; one that comes back is drawn anew.
document.addEventListener("visibilitychange", () => {
  if (!document.hidden) changed();
});

connect();
