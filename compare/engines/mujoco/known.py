"""What MuJoCo's models have from 3.10 to 4.0.0, and the reader has been checked with: anything else is not known."""


def word_set(text: str, prefix: str = "") -> frozenset:
    """The word_set of a text, each after a prefix."""
    return frozenset(prefix + word for word in text.split())


KNOWN_COUNTS = word_set("""
nB nC nD nJfe nJfv nJmom nJten nM na nactuator narena nbody nbuffer nbvh nbvhdynamic nbvhstatic ncam nconmax
nefm0L nefm0dof nefmCvert nemax neq nexclude nflex nflexbending nflexedge nflexelem nflexelemdata
nflexelemedge nflexevpair nflexnode nflexshelldata nflexstiffness nflextexcoord nflexvert ngeom ngravcomp
nhfield nhfielddata nhistory njmax njnt nkey nlight nmat nmesh nmeshdegmax nmeshface nmeshgraph nmeshnormal
nmeshpoly nmeshpolymap nmeshpolyvert nmeshtexcoord nmeshvert nmocap nnames nnames_map nnumeric nnumericdata
noct nout npair npaths nplastic nplugin npluginattr npluginstate npolygonmax nq nsensor nsensordata nsite
nskin nskinbone nskinbonevert nskinface nskintexvert nskinvert ntendon ntex ntexdata ntext ntextdata ntree
ntuple ntupledata nu nuser_actuator nuser_body nuser_cam nuser_geom nuser_jnt nuser_sensor nuser_site
nuser_tendon nuserdata nv nwrap
""")
KNOWN_OPTIONS = word_set("""
ccd_iterations ccd_tolerance cone density disableactuator disableflags enableflags gravity impratio integrator
iterations jacobian ls_iterations ls_tolerance magnetic noslip_iterations noslip_tolerance o_friction o_margin
o_solimp o_solref sdf_initpoints sdf_iterations sleep_tolerance solver timestep tolerance viscosity wind
""")
KNOWN_DISABLING = word_set("""
ACTUATION AUTORESET CLAMPCTRL CONSTRAINT CONTACT DAMPER EQUALITY EULERDAMP FILTERPARENT FRICTIONLOSS GRAVITY
ISLAND LIMIT MIDPHASE MULTICCD NATIVECCD REFSAFE SENSOR SPRING WARMSTART
""")
KNOWN_ENABLING = word_set("""
DIAGEXACT ENERGY FWDINV INVDISCRETE IPC OVERRIDE SLEEP SPECULATIVE
""")
KNOWN_FIELDS = frozenset()
KNOWN_FIELDS |= word_set(
    """
    bvhadr bvhnum conaffinity contype dofadr dofnum geomadr geomnum gravcomp inertia invweight0 ipos
    iquat jntadr jntnum margin mass mocapid parentid plugin pos quat rootid sameframe simple subtreemass
    treeid user weldid
    """,
    "body_",
)
KNOWN_FIELDS |= word_set(
    """
    M0 Madr armature bodyid damping dampingpoly frictionloss invweight0 jntid length parentid simplenum
    solimp solref treeid
    """,
    "dof_",
)
KNOWN_FIELDS |= word_set(
    """
    actfrclimited actfrcrange actgravcomp actuatorid axis bodyid dofadr group limited margin plasticadr
    pos qposadr range solimp solref springyield stiffness stiffnesspoly type user
    """,
    "jnt_",
)
KNOWN_FIELDS |= word_set(
    """
    actfrclimited actfrcrange actuatorid adr armature damping dampingpoly frictionloss group invweight0
    length0 lengthspring limited margin matid num plasticadr range rgba solimp_fri solimp_lim solref_fri
    solref_lim springyield stiffness stiffnesspoly treeid treenum type user width
    """,
    "tendon_",
)
KNOWN_FIELDS |= word_set(
    """
    active0 data obj1id obj2id objtype solimp solref type
    """,
    "eq_",
)
KNOWN_FIELDS |= word_set(
    """
    acc0 actadr actearly actlimited actnum actrange armature biasprm biastype cranklength ctrladr
    ctrllimited ctrlnum ctrlrange ctrlspec damping dampingpoly delay dynprm dyntype forcelimited
    forcerange gainprm gaintype gear group history historyadr length0 lengthrange outadr outnum plugin
    trnid trntype user
    """,
    "actuator_",
)
