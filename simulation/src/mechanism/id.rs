//! Names of mechanisms.

macro_rules! ids {
    ($($variant:ident $name:literal $doc:literal,)*) => {
        /// Name of a mechanism, as the public contract has it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Id { $(#[doc = $doc] $variant,)* }

        impl Id {
            /// All of them, in the order of the contract.
            pub const ALL: &'static [Id] = &[$(Id::$variant,)*];

            /// The name.
            pub const fn name(self) -> &'static str {
                match self { $(Id::$variant => $name,)* }
            }
        }
    };
}

ids! {
    SealDrag "seal-drag" "Constant drag of seals, wipers and cages.",
    ViscousDrag "viscous-drag" "Drag that grows with speed and not with load: seals, churning.",
    ViscosityTemperature "viscosity-temperature" "The oil thins as it warms.",
    SelfHeating "self-heating" "Friction warms the oil.",
    HysteresisAndSlip "hysteresis-and-slip" "Elastic hysteresis and Heathcote slip.",
    HydrodynamicRolling "hydrodynamic-rolling" "Rolling resistance of the oil in the inlet.",
    TractionSaturation "traction-saturation" "Shear of the oil film saturates.",
    Stribeck "stribeck" "Mixed friction at low speed.",
    Starvation "starvation" "The oil film runs dry.",
    RunIn "run-in" "Drag that decays with travel.",
    ExternalLoad "external-load" "A known load beside the preload.",
    MomentLoad "moment-load" "The drive pulls beside the guide; spin.",
    RailStraightness "rail-straightness" "Preload follows the shape of the rail.",
    RailJoint "rail-joint" "A step between two rails.",
    PreloadLoss "preload-loss" "Wear takes preload away.",
    ThermalPreload "thermal-preload" "Block and rail differ in temperature.",
    DirectionAsymmetry "direction-asymmetry" "Friction differs between the directions.",
    GravityTilt "gravity-tilt" "The axis is not level.",
    Inertia "inertia" "Mass that the simulation does not accelerate.",
    CableChain "cable-chain" "Chains, hoses, bellows.",
    DriveRipple "drive-ripple" "Screw pitch, cogging, coupling.",
    Contamination "contamination" "A particle on the raceway.",
    BallPass "ball-pass" "Balls enter and leave the loaded zone.",
    Presliding "presliding" "Friction builds up over a displacement.",
    FrictionalLag "frictional-lag" "Friction follows speed with a lag.",
    BreakawayDwell "breakaway-dwell" "Friction after rest grows with the rest.",
    StructuralResonance "structural-resonance" "The structure rings.",
    ForceOffset "force-offset" "Zero of the force sensor.",
    ForceDrift "force-drift" "Drift of that zero.",
    ForceGain "force-gain" "Gain of the force sensor.",
    LoadCrosstalk "load-crosstalk" "Preload or load read as drag.",
    ForceLowpass "force-lowpass" "A filter in the force channel.",
    TimeMisalignment "time-misalignment" "Force and position are not of one instant.",
    ForceQuantisation "force-quantisation" "Steps of the force converter.",
    ForceSaturation "force-saturation" "The force channel clips.",
    CouplingBacklash "coupling-backlash" "Play between drive and carriage.",
    SpeedNoise "speed-noise" "Noise of the measured speed.",
    EncoderCyclicError "encoder-cyclic-error" "Error that repeats with the encoder's period.",
}

impl Id {
    /// The mechanism of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Id::ALL.iter().copied().find(|id| id.name() == name)
    }
}
