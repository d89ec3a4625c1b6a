//! What the textures of a planet say: colours, heights, lights, clouds.

/// What a texture of a planet says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Attribute {
    /// The ground by day.
    Color,
    /// How high it is, in the first channel.
    Height,
    /// How light it is by night, in the first channel.
    Night,
    /// How dense the clouds over it are, in the first channel.
    Clouds,
}

impl Attribute {
    /// Every attribute.
    pub const ALL: [Attribute; 4] =
        [Attribute::Color, Attribute::Height, Attribute::Night, Attribute::Clouds];

    /// Its name, as the member of a group and for people.
    pub fn name(self) -> &'static str {
        match self {
            Attribute::Color => "color",
            Attribute::Height => "height",
            Attribute::Night => "night",
            Attribute::Clouds => "clouds",
        }
    }

    /// What is seen where there is no texture of it.
    pub(crate) fn without(self) -> &'static str {
        match self {
            Attribute::Color => "vec4<f32>(0.35, 0.35, 0.35, 1.0)",
            Attribute::Height | Attribute::Night | Attribute::Clouds => "vec4<f32>()",
        }
    }
}
