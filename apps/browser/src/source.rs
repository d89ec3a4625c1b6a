//! A channel of a volume in a container, as a source of tiles.

use std::sync::Arc;

use vastex::source::{Container, ReadFuture};
use vastex::{Description, PagePos, TileSource};

/// A texture of a container: a channel at a time.
pub(crate) struct ContainerTexture {
    container: Arc<Container>,
    number: u64,
}

impl ContainerTexture {
    /// All textures of a container, in its order: the channels of the first time, then those of the next.
    pub(crate) fn all(container: Container) -> impl Iterator<Item = ContainerTexture> {
        let textures = container.volume().map_or(1, |volume| volume.textures());
        let container = Arc::new(container);
        (0..textures).map(move |number| ContainerTexture { container: container.clone(), number })
    }
}

impl TileSource for ContainerTexture {
    fn description(&self) -> &Arc<Description> {
        self.container.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(self.container.read_of(self.number, pos))
    }
}
