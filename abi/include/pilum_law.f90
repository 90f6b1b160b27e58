! For authors of laws in Fortran: the contract of pilum_law.h as a module, and what every law does
! alike. The first part mirrors the structs; a test compares sizes and offsets with the header. The
! second part describes laws, checks their parameters, walks the batch, and writes outcomes and the
! message; what is left to the author is a description and a subroutine that carries one point over
! one increment.
!
! `stop`, `error stop` and failing I/O end the host: return a status and a reason instead. Compile
! with -frecursive, so that no local variable is shared between threads.
module pilum
  use, intrinsic :: iso_c_binding
  implicit none
  public

  integer, parameter :: dp = c_double

  ! ---- the contract ------------------------------------------------------------------------------

  integer(c_int32_t), parameter :: PILUM_MAGIC_NUMBER = int(z'50494C4D', c_int32_t)
  integer(c_int16_t), parameter :: PILUM_ABI_MAJOR = 1
  integer(c_int16_t), parameter :: PILUM_ABI_MINOR = 0
  integer(c_int64_t), parameter :: PILUM_LAYOUT_HASH = int(z'B8583DA8C195E927', c_int64_t)

  integer(c_int32_t), parameter :: PILUM_OK = 0
  integer(c_int32_t), parameter :: PILUM_OK_UNRELIABLE = 1
  integer(c_int32_t), parameter :: PILUM_CUT_STEP = 2
  integer(c_int32_t), parameter :: PILUM_E_ARGUMENT = -1
  integer(c_int32_t), parameter :: PILUM_E_PARAMETER = -2
  integer(c_int32_t), parameter :: PILUM_E_UNSUPPORTED = -3
  integer(c_int32_t), parameter :: PILUM_E_DOMAIN = -4
  integer(c_int32_t), parameter :: PILUM_E_NUMERIC = -5
  integer(c_int32_t), parameter :: PILUM_E_INTERNAL = -6

  integer(c_int32_t), parameter :: PILUM_H_PLANE_STRAIN = 1
  integer(c_int32_t), parameter :: PILUM_H_AXISYMMETRIC = 2
  integer(c_int32_t), parameter :: PILUM_H_3D = 3
  integer(c_int32_t), parameter :: PILUM_H_INTERFACE_2D = 10
  integer(c_int32_t), parameter :: PILUM_H_INTERFACE_3D = 11

  integer(c_int32_t), parameter :: PILUM_SCALAR = 0
  integer(c_int32_t), parameter :: PILUM_VECTOR = 1
  integer(c_int32_t), parameter :: PILUM_SYMMETRIC_TENSOR = 2

  integer(c_int32_t), parameter :: PILUM_P_OPEN_LOWER = 1
  integer(c_int32_t), parameter :: PILUM_P_OPEN_UPPER = 2
  integer(c_int32_t), parameter :: PILUM_P_OPTIONAL = 4
  integer(c_int32_t), parameter :: PILUM_V_OUTPUT_ONLY = 1
  integer(c_int32_t), parameter :: PILUM_T_SYMMETRIC = 1
  integer(c_int32_t), parameter :: PILUM_T_LINEAR = 2
  integer(c_int32_t), parameter :: PILUM_T_LOCAL_AXES = 4
  integer(c_int32_t), parameter :: PILUM_T_RATES = 8
  integer(c_int32_t), parameter :: PILUM_T_TANGENT_APPROXIMATE = 16
  integer(c_int32_t), parameter :: PILUM_T_NO_TANGENT = 32
  integer(c_int32_t), parameter :: PILUM_REQ_FLUX = 1
  integer(c_int32_t), parameter :: PILUM_REQ_TANGENT = 2
  integer(c_int32_t), parameter :: PILUM_REQ_ELASTIC = 4
  integer(c_int32_t), parameter :: PILUM_REQ_RATES = 8

  type, bind(C) :: pilum_magic_block
    integer(c_int32_t) :: struct_size, magic
    integer(c_int16_t) :: abi_major, abi_minor
    integer(c_int8_t) :: pointer_bytes, real_bytes, reserved(2)
    integer(c_int64_t) :: layout_hash
    character(kind=c_char) :: sdk(40)
  end type

  type, bind(C) :: pilum_parameter
    integer(c_int32_t) :: struct_size, flags
    type(c_ptr) :: id, symbol, unit, doc
    real(c_double) :: default_value, lower, upper, usual_lower, usual_upper
    type(c_ptr) :: choices
  end type

  type, bind(C) :: pilum_variable
    integer(c_int32_t) :: struct_size, flags
    type(c_ptr) :: id, symbol, unit, doc
    integer(c_int32_t) :: shape, n_components
    type(c_ptr) :: component_names
    real(c_double) :: initial_value
  end type

  type, bind(C) :: pilum_formulation
    integer(c_int32_t) :: struct_size, hypothesis, flags, n_gradients, n_fluxes, n_states
    type(c_ptr) :: gradient, flux, state
  end type

  type, bind(C) :: pilum_view
    type(c_ptr) :: p
    integer(c_intptr_t) :: point, component
  end type

  type, bind(C) :: pilum_view_mut
    type(c_ptr) :: p
    integer(c_intptr_t) :: point, component
  end type

  type, bind(C) :: pilum_batch
    integer(c_int32_t) :: struct_size, request
    integer(c_int64_t) :: n_points, first_point
    real(c_double) :: time, time_increment
    type(pilum_view) :: gradient0, gradient1, flux0, state0
    type(pilum_view_mut) :: flux1, state1, tangent
    type(c_ptr) :: status, step_factor, message
    integer(c_size_t) :: message_capacity
    real(c_double) :: step_time
    type(c_ptr) :: rates
  end type

  type, bind(C) :: pilum_rates
    integer(c_int32_t) :: struct_size, reserved
    type(c_ptr) :: parameter
    type(pilum_view) :: gradient0, gradient1, flux0, state0
    type(pilum_view_mut) :: flux1, state1
  end type

  type, bind(C) :: pilum_host
    integer(c_int32_t) :: struct_size
    integer(c_int16_t) :: abi_major, abi_minor
    type(c_ptr) :: name, version
    type(c_funptr) :: get_extension
  end type

  type, bind(C) :: pilum_law
    integer(c_int32_t) :: struct_size, flags, n_parameters, n_formulations
    type(c_ptr) :: id, name, version, author, licence, doc, references, parameter, formulation
    type(c_funptr) :: create, init_state, integrate, destroy
  end type

  type, bind(C) :: pilum_plugin
    integer(c_int32_t) :: struct_size, n_laws
    type(c_ptr) :: law
    type(c_funptr) :: get_extension
  end type

  ! ---- what an author writes ---------------------------------------------------------------------

  ! What this module has room for; more is refused with a message as soon as parameters are given.
  integer, parameter :: MAX_COMPONENTS = 6, MAX_PARAMETERS = 256, MAX_STATES = 256
  integer, parameter :: MAX_FORMULATIONS = 4, MAX_LAWS = 16, MAX_CHOICES = 32

  ! Which operator the host wants beside the update.
  integer, parameter :: TANGENT_NONE = 0, TANGENT_ELASTIC = 1, TANGENT_CONSISTENT = 2

  ! One integration point at the start of an increment, and the increment.
  type :: point_type
    ! Number of components: 2 for interfaces in the plane, 3 in space; 4 for solids in the plane, 6 in
    ! space; and of internal
    ! variables.
    integer :: n, n_states
    ! Strain or jump at the start, its increment, stress or traction at the start (kPa); components
    ! beyond n are zero.
    real(dp) :: gradient(MAX_COMPONENTS), increment(MAX_COMPONENTS), flux(MAX_COMPONENTS)
    ! Internal variables at the start.
    real(dp) :: state(MAX_STATES)
    real(dp) :: time, time_increment
    ! Time at the start, counted from the start of the phase or segment.
    real(dp) :: step_time
  end type

  ! The same point at the end of the increment; all zero when the author receives it.
  type :: response_type
    real(dp) :: flux(MAX_COMPONENTS)
    real(dp) :: state(MAX_STATES)
    ! tangent(i, j) = d flux(i) / d gradient(j), as DDSDDE(i, j).
    real(dp) :: tangent(MAX_COMPONENTS, MAX_COMPONENTS)
    ! With any outcome but PILUM_OK: why.
    character(len=120) :: reason
    ! With PILUM_CUT_STEP: the fraction of the increment that the law can follow; NaN: the host's choice.
    real(dp) :: step_factor
  end type

  abstract interface
    ! Looks at the parameters, each within its bounds already, and may put into `p` what the update
    ! needs instead. A text in `refusal` refuses them: `id: value is above ...`.
    subroutine prepare_interface(p, refusal)
      import :: dp
      real(dp), intent(inout) :: p(:)
      character(len=*), intent(inout) :: refusal
    end subroutine

    ! Initial internal variables of a point that carries this flux before anything has happened;
    ! components beyond those of the hypothesis are zero, `state` is all zero at first.
    subroutine initial_interface(p, flux, state, reason, status)
      import :: dp, c_int32_t
      real(dp), intent(in) :: p(:), flux(:)
      real(dp), intent(inout) :: state(:)
      character(len=*), intent(inout) :: reason
      integer(c_int32_t), intent(inout) :: status
    end subroutine

    ! Carries one point over one increment; `p` is what `prepare` left. A pure function of its
    ! arguments: no saved variables, no I/O, no allocation.
    subroutine update_interface(p, point, tangent, end, status)
      import :: dp, point_type, response_type, c_int32_t
      real(dp), intent(in) :: p(:)
      type(point_type), intent(in) :: point
      integer, intent(in) :: tangent
      type(response_type), intent(inout) :: end
      integer(c_int32_t), intent(inout) :: status
    end subroutine
  end interface

  ! ---- the laws of this library ------------------------------------------------------------------

  integer(c_int64_t), parameter, private :: NAN_BITS = int(z'7FF8000000000000', c_int64_t)
  integer(c_int64_t), parameter, private :: INFINITY_BITS = int(z'7FF0000000000000', c_int64_t)
  real(dp), parameter, private :: NAN = transfer(NAN_BITS, 1.0_dp)
  real(dp), parameter, private :: INFINITY = transfer(INFINITY_BITS, 1.0_dp)
  character(len=*), parameter, private :: SDK_NAME = 'pilum-fortran 1.1'
  integer, private :: sdk_letter

  type(pilum_magic_block), bind(C, name='pilum_magic'), target, save :: pilum_magic = &
    pilum_magic_block(64, PILUM_MAGIC_NUMBER, PILUM_ABI_MAJOR, PILUM_ABI_MINOR, 8_c_int8_t, &
    8_c_int8_t, 0_c_int8_t, PILUM_LAYOUT_HASH, &
    [(SDK_NAME(sdk_letter:sdk_letter), sdk_letter=1, len(SDK_NAME)), &
    (c_null_char, sdk_letter=len(SDK_NAME) + 1, 40)])

  ! Static: the host keeps pointers into all of it. It is filled by the first call of the entry,
  ! which must be over before another begins; the Pilum host opens libraries one at a time.
  character(kind=c_char), target, save, private :: texts(65536)
  integer, save, private :: n_texts = 0

  ! A law as its author describes it. Without initial values, which would fill the library's file.
  type, private :: described_type
    type(pilum_parameter) :: parameters(MAX_PARAMETERS)
    type(c_ptr) :: choices(MAX_CHOICES, MAX_PARAMETERS)
    type(pilum_variable) :: states(MAX_STATES)
    type(pilum_variable) :: gradients(MAX_FORMULATIONS), fluxes(MAX_FORMULATIONS)
    type(c_ptr) :: component_names(MAX_COMPONENTS, MAX_FORMULATIONS)
    type(pilum_formulation) :: formulations(MAX_FORMULATIONS)
    type(pilum_law) :: law
    procedure(prepare_interface), pointer, nopass :: prepare
    procedure(update_interface), pointer, nopass :: update
    procedure(initial_interface), pointer, nopass :: initial
    ! What there was no room for.
    character(len=80) :: excess
  end type

  type(described_type), target, save, private :: described_laws(MAX_LAWS)
  integer, save, private :: n_laws = 0
  type(c_ptr), target, save, private :: the_laws(MAX_LAWS)
  type(pilum_plugin), target, save, private :: the_plugin
  logical, save, private :: is_described = .false.

  ! What an instance holds.
  type, private :: instance_type
    real(dp) :: p(MAX_PARAMETERS)
    integer :: n_parameters, n_components, n_states
    procedure(update_interface), pointer, nopass :: update
    procedure(initial_interface), pointer, nopass :: initial
  end type

  private :: text, say, point_says, create, integrate, init_state, destroy, element, put, locate, &
    is_finite, is_worse, exceed, tell

contains

  ! Whether the description is complete: the entry describes the laws once.
  logical function described()
    described = is_described
  end function

  ! Begins the description of a law, one of several perhaps: its name and subroutines. Its parameters,
  ! internal variables and formulations follow. Without `initial` each internal variable starts from
  ! the value it is declared with.
  subroutine describe_law(id, name, version, author, licence, doc, references, prepare, update, &
    initial)
    character(len=*), intent(in) :: id, name, version, author, licence, doc, references
    procedure(prepare_interface) :: prepare
    procedure(update_interface) :: update
    procedure(initial_interface), optional :: initial
    type(c_funptr) :: init
    if (n_laws == MAX_LAWS) then
      call exceed('more laws than MAX_LAWS')
      return
    end if
    n_laws = n_laws + 1
    init = c_null_funptr
    associate (new => described_laws(n_laws))
      new%prepare => prepare
      new%update => update
      nullify (new%initial)
      new%excess = ''
      if (present(initial)) then
        new%initial => initial
        init = c_funloc(init_state)
      end if
      new%law = pilum_law(int(c_sizeof(new%law), c_int32_t), 0, 0, 0, text(id), text(name), &
        text(version), text(author), text(licence), text(doc), text(references), &
        c_loc(new%parameters), c_loc(new%formulations), c_funloc(create), init, &
        c_funloc(integrate), c_funloc(destroy))
    end associate
  end subroutine

  ! Remembers what there is no room for; the law then refuses its parameters.
  subroutine exceed(what)
    character(len=*), intent(in) :: what
    described_laws(n_laws)%excess = what//', see pilum_law.f90'
  end subroutine

  ! Declares the next parameter. Bounds are inclusive: `lower <= value <= upper`; `above`, `below`
  ! exclude the bound itself. Values outside `usual` draw a warning. With `choices` the value is the
  ! number of a label, from 0. An `optional` one may be left out and is then NaN.
  subroutine add_parameter(id, symbol, unit, doc, lower, upper, above, below, usual, default, &
    choices, optional)
    character(len=*), intent(in) :: id, symbol, unit, doc
    real(dp), intent(in), optional :: lower, upper, above, below, usual(2), default
    character(len=*), intent(in), optional :: choices(:)
    logical, intent(in), optional :: optional
    type(pilum_parameter) :: new
    integer :: n, k
    associate (law => described_laws(n_laws))
      n = law%law%n_parameters + 1
      if (n > MAX_PARAMETERS) then
        call exceed('more parameters than MAX_PARAMETERS')
        return
      end if
      new = pilum_parameter(int(c_sizeof(new), c_int32_t), 0, text(id), text(symbol), text(unit), &
        text(doc), NAN, -INFINITY, INFINITY, -INFINITY, INFINITY, c_null_ptr)
      if (present(lower)) new%lower = lower
      if (present(upper)) new%upper = upper
      if (present(above)) then
        new%lower = above
        new%flags = ior(new%flags, PILUM_P_OPEN_LOWER)
      end if
      if (present(below)) then
        new%upper = below
        new%flags = ior(new%flags, PILUM_P_OPEN_UPPER)
      end if
      if (present(usual)) then
        new%usual_lower = usual(1)
        new%usual_upper = usual(2)
      end if
      if (present(default)) new%default_value = default
      if (present(optional)) then
        if (optional) new%flags = ior(new%flags, PILUM_P_OPTIONAL)
      end if
      if (present(choices)) then
        if (size(choices) >= MAX_CHOICES) then
          call exceed('more labels of '//id//' than MAX_CHOICES')
          return
        end if
        do k = 1, size(choices)
          law%choices(k, n) = text(trim(choices(k)))
        end do
        law%choices(size(choices) + 1, n) = c_null_ptr
        new%choices = c_loc(law%choices(1, n))
        new%lower = 0
        new%upper = size(choices) - 1
      end if
      law%law%n_parameters = n
      law%parameters(n) = new
    end associate
  end subroutine

  ! Declares the internal variables, all numbers, before the formulations. They start from `initial`,
  ! 0 if it is left out; an `output_only` one is a result that the law does not read back.
  subroutine add_state(number, id, symbol, unit, doc, initial, output_only)
    integer, intent(in) :: number
    character(len=*), intent(in) :: id, symbol, unit, doc
    real(dp), intent(in), optional :: initial
    logical, intent(in), optional :: output_only
    type(pilum_variable) :: new
    if (number < 1 .or. number > MAX_STATES) then
      call exceed('internal variable '//id//' is not within 1 and MAX_STATES')
      return
    end if
    new = pilum_variable(int(c_sizeof(new), c_int32_t), 0, text(id), text(symbol), text(unit), &
      text(doc), PILUM_SCALAR, 1, c_null_ptr, 0.0_dp)
    if (present(initial)) new%initial_value = initial
    if (present(output_only)) then
      if (output_only) new%flags = PILUM_V_OUTPUT_ONLY
    end if
    described_laws(n_laws)%states(number) = new
  end subroutine

  ! Declares a hypothesis that the law offers, with its first `n_states` internal variables, which
  ! may be none.
  subroutine add_formulation(hypothesis, n_states, flags)
    integer(c_int32_t), intent(in) :: hypothesis
    integer, intent(in) :: n_states
    integer(c_int32_t), intent(in), optional :: flags
    character(len=2), parameter :: solid(6) = ['11', '22', '33', '12', '13', '23']
    character(len=1), parameter :: interface(3) = ['n', 't', 's']
    type(c_ptr) :: names
    integer :: f, c, n
    associate (law => described_laws(n_laws))
      f = law%law%n_formulations + 1
      if (f > MAX_FORMULATIONS .or. n_states > MAX_STATES) then
        call exceed('more formulations or internal variables than there is room for')
        return
      end if
      law%law%n_formulations = f
      names = c_loc(law%component_names(1, f))
      if (hypothesis == PILUM_H_INTERFACE_2D .or. hypothesis == PILUM_H_INTERFACE_3D) then
        n = merge(2, 3, hypothesis == PILUM_H_INTERFACE_2D)
        do c = 1, n
          law%component_names(c, f) = text(interface(c))
        end do
        law%gradients(f) = variable('jump', '[u]', 'm', &
          'Relative displacement across the interface, opening positive.', PILUM_VECTOR)
        law%fluxes(f) = variable('traction', 't', 'kPa', &
          'Traction on the interface, tension positive.', PILUM_VECTOR)
      else
        n = merge(6, 4, hypothesis == PILUM_H_3D)
        do c = 1, n
          law%component_names(c, f) = text(solid(c))
        end do
        law%gradients(f) = variable('strain', 'eps', '-', 'Strain, engineering shear.', &
          PILUM_SYMMETRIC_TENSOR)
        law%fluxes(f) = variable('stress', 'sigma', 'kPa', 'Stress, tension positive.', &
          PILUM_SYMMETRIC_TENSOR)
      end if
      law%formulations(f) = pilum_formulation(int(c_sizeof(law%formulations(1)), c_int32_t), &
        hypothesis, 0, 1, 1, n_states, c_loc(law%gradients(f)), c_loc(law%fluxes(f)), &
        c_loc(law%states))
      if (present(flags)) law%formulations(f)%flags = flags
    end associate

  contains

    type(pilum_variable) function variable(id, symbol, unit, doc, shape)
      character(len=*), intent(in) :: id, symbol, unit, doc
      integer(c_int32_t), intent(in) :: shape
      variable = pilum_variable(int(c_sizeof(variable), c_int32_t), 0, text(id), text(symbol), &
        text(unit), text(doc), shape, n, names, 0.0_dp)
    end function
  end subroutine

  ! What the entry returns once everything is described.
  type(c_ptr) function the_library()
    integer :: k
    do k = 1, n_laws
      the_laws(k) = c_loc(described_laws(k)%law)
    end do
    the_plugin = pilum_plugin(int(c_sizeof(the_plugin), c_int32_t), n_laws, c_loc(the_laws), &
      c_null_funptr)
    is_described = .true.
    the_library = c_loc(the_plugin)
  end function

  ! The consistent tangent by central differences, for a law that has written none: two more updates
  ! for each component. `size` is a strain or jump over which the response bends, such as strength
  ! over stiffness; where the response is smooth over 1e-5 of it and the update is good to round-off,
  ! the error is about 1e-10 of the stiffness. At a kink the result lies between those of its sides.
  ! `update` is called with TANGENT_NONE; what fails there is the outcome, and what is unreliable there
  ! makes an outcome of PILUM_OK unreliable.
  subroutine differentiate(p, point, update, size, end, status)
    real(dp), intent(in) :: p(:), size
    type(point_type), intent(in) :: point
    procedure(update_interface) :: update
    type(response_type), intent(inout) :: end
    integer(c_int32_t), intent(inout) :: status
    type(point_type) :: moved
    type(response_type) :: trial
    real(dp) :: flux(MAX_COMPONENTS, 2), increment(2)
    integer(c_int32_t) :: outcome
    integer :: n, column, side
    n = point%n
    moved = point
    do column = 1, n
      do side = 1, 2
        moved%increment(column) = point%increment(column) + (2*side - 3)*6e-6_dp*size
        increment(side) = moved%increment(column)
        call clear(point, trial)
        outcome = PILUM_OK
        call update(p, moved, TANGENT_NONE, trial, outcome)
        if (outcome /= PILUM_OK .and. outcome /= PILUM_OK_UNRELIABLE) then
          end%reason = trial%reason
          end%step_factor = trial%step_factor
          status = outcome
          return
        end if
        if (outcome == PILUM_OK_UNRELIABLE .and. status == PILUM_OK) then
          end%reason = trial%reason
          status = outcome
        end if
        flux(:n, side) = trial%flux(:n)
      end do
      moved%increment(column) = point%increment(column)
      end%tangent(:n, column) = (flux(:n, 2) - flux(:n, 1))/(increment(2) - increment(1))
    end do
  end subroutine

  ! The response as the author receives it.
  subroutine clear(point, end)
    type(point_type), intent(in) :: point
    type(response_type), intent(inout) :: end
    end%flux = 0
    end%state(:point%n_states) = 0
    end%tangent = 0
    end%reason = 'the law gives no reason'
    end%step_factor = NAN
  end subroutine

  ! ---- the host's calls --------------------------------------------------------------------------

  function create(law, host, number, parameter, n_parameters, out, message, capacity) &
    result(status) bind(C, name='')
    type(c_ptr), value :: law, host, parameter, out, message
    integer(c_int32_t), value :: number, n_parameters
    integer(c_size_t), value :: capacity
    integer(c_int32_t) :: status
    real(c_double), pointer :: values(:)
    type(c_ptr), pointer :: written
    type(instance_type), pointer :: instance
    type(described_type), pointer :: mine
    character(len=200) :: refusal
    logical :: is_inside
    integer :: i, error
    call say(message, capacity, '')
    nullify (mine)
    do i = 1, n_laws
      if (c_associated(law, c_loc(described_laws(i)%law))) mine => described_laws(i)
    end do
    status = PILUM_E_ARGUMENT
    if (.not. associated(mine)) then
      call say(message, capacity, 'there is no such law')
    else if (number < 0 .or. number >= mine%law%n_formulations) then
      call say(message, capacity, 'there is no such formulation')
    else if (n_parameters /= mine%law%n_parameters .or. .not. c_associated(out) .or. &
      (n_parameters > 0 .and. .not. c_associated(parameter))) then
      call say(message, capacity, 'wrong number of parameters')
    else if (mine%excess /= '') then
      call say(message, capacity, trim(mine%excess))
      status = PILUM_E_INTERNAL
    else
      status = PILUM_OK
    end if
    if (status /= PILUM_OK) return
    ! Read as an array only where there is one.
    if (n_parameters > 0) call c_f_pointer(parameter, values, [n_parameters])
    do i = 1, n_parameters
      associate (declared => mine%parameters(i), x => values(i))
        if (iand(declared%flags, PILUM_P_OPTIONAL) /= 0 .and. is_nan(x)) cycle
        is_inside = is_finite(x) .and. x >= declared%lower .and. x <= declared%upper
        if (iand(declared%flags, PILUM_P_OPEN_LOWER) /= 0) is_inside = is_inside .and. x > declared%lower
        if (iand(declared%flags, PILUM_P_OPEN_UPPER) /= 0) is_inside = is_inside .and. x < declared%upper
        if (is_inside .and. c_associated(declared%choices)) &
          is_inside = .not. (x < nint(x) .or. x > nint(x))
        if (.not. is_inside) then
          call say(message, capacity, name_of(declared%id)//': the value is not admissible')
          status = PILUM_E_PARAMETER
          return
        end if
      end associate
    end do
    allocate (instance, stat=error)
    if (error /= 0) then
      call say(message, capacity, 'no memory')
      status = PILUM_E_INTERNAL
      return
    end if
    instance%p = 0
    if (n_parameters > 0) instance%p(:n_parameters) = values
    instance%n_parameters = n_parameters
    instance%n_states = mine%formulations(number + 1)%n_states
    instance%n_components = mine%fluxes(number + 1)%n_components
    instance%update => mine%update
    instance%initial => mine%initial
    refusal = ''
    call mine%prepare(instance%p(:n_parameters), refusal)
    if (refusal /= '') then
      call say(message, capacity, trim(refusal))
      deallocate (instance)
      status = PILUM_E_PARAMETER
      return
    end if
    call c_f_pointer(out, written)
    written = c_loc(instance)
  end function

  subroutine destroy(opaque) bind(C, name='')
    type(c_ptr), value :: opaque
    type(instance_type), pointer :: instance
    integer :: error
    if (.not. c_associated(opaque)) return
    call c_f_pointer(opaque, instance)
    deallocate (instance, stat=error)
  end subroutine

  ! Instance and batch of a call, and a message that ends; `status` says if they can be used.
  subroutine open_call(opaque, call_of_host, known, instance, batch, status)
    type(c_ptr), intent(in) :: opaque, call_of_host
    integer(c_int32_t), intent(in) :: known
    type(instance_type), pointer, intent(out) :: instance
    type(pilum_batch), pointer, intent(out) :: batch
    integer(c_int32_t), intent(out) :: status
    ! Size of the batch in version 1.0.
    integer(c_int32_t), parameter :: SIZE_1_0 = 256
    integer(c_int32_t), pointer :: struct_size
    status = PILUM_E_ARGUMENT
    nullify (instance, batch)
    if (.not. c_associated(call_of_host)) return
    call c_f_pointer(call_of_host, struct_size)
    if (struct_size < SIZE_1_0) return
    call c_f_pointer(call_of_host, batch)
    call say(batch%message, batch%message_capacity, '')
    if (iand(batch%request, not(known)) /= 0) then
      call say(batch%message, batch%message_capacity, 'an unknown request')
      status = PILUM_E_UNSUPPORTED
    else if (.not. c_associated(opaque)) then
      call say(batch%message, batch%message_capacity, 'the instance is null')
    else
      call c_f_pointer(opaque, instance)
      status = PILUM_OK
    end if
  end subroutine

  function init_state(opaque, call_of_host) result(worst) bind(C, name='')
    type(c_ptr), value :: opaque, call_of_host
    integer(c_int32_t) :: worst, status
    type(pilum_batch), pointer :: batch
    type(instance_type), pointer :: instance
    real(dp) :: flux(MAX_COMPONENTS), state(MAX_STATES)
    character(len=120) :: reason
    integer(c_int64_t) :: i
    integer :: c, m
    logical :: are_finite, is_null
    call open_call(opaque, call_of_host, 0, instance, batch, worst)
    if (worst /= PILUM_OK) return
    m = instance%n_states
    is_null = .not. c_associated(batch%flux0%p)
    if (m > 0) is_null = is_null .or. .not. c_associated(batch%state1%p)
    if (is_null .and. batch%n_points > 0) then
      call say(batch%message, batch%message_capacity, 'a view that is needed is null')
      worst = PILUM_E_ARGUMENT
      return
    end if
    do i = 0, batch%n_points - 1
      flux = 0
      state(:m) = 0
      are_finite = .true.
      do c = 1, instance%n_components
        flux(c) = element(batch%flux0%p, batch%flux0%point, batch%flux0%component, i, c)
        are_finite = are_finite .and. is_finite(flux(c))
      end do
      status = PILUM_E_NUMERIC
      reason = 'an input is not finite'
      if (are_finite) then
        status = PILUM_OK
        reason = 'the law gives no reason'
        call instance%initial(instance%p(:instance%n_parameters), flux, state(:m), reason, status)
      end if
      if (status == PILUM_OK) then
        do c = 1, m
          call put(batch%state1, i, c, state(c), are_finite)
        end do
        if (.not. are_finite) then
          reason = 'a result is not finite'
          status = PILUM_E_NUMERIC
        end if
      end if
      call tell(batch, i, status, reason, worst)
      if (status == PILUM_E_INTERNAL) exit
    end do
  end function

  function integrate(opaque, call_of_host) result(worst) bind(C, name='')
    type(c_ptr), value :: opaque, call_of_host
    integer(c_int32_t) :: worst, status
    integer(c_int32_t), parameter :: KNOWN = PILUM_REQ_FLUX + PILUM_REQ_TANGENT + PILUM_REQ_ELASTIC
    type(pilum_batch), pointer :: batch
    type(instance_type), pointer :: instance
    type(point_type) :: point
    type(response_type) :: end
    real(c_double), pointer :: step_factors(:)
    integer(c_int64_t) :: i
    integer :: tangent, n, m, c, row
    logical :: are_finite, is_null
    call open_call(opaque, call_of_host, KNOWN, instance, batch, worst)
    if (worst /= PILUM_OK) return
    n = instance%n_components
    m = instance%n_states
    tangent = TANGENT_NONE
    if (iand(batch%request, PILUM_REQ_TANGENT) /= 0) tangent = TANGENT_CONSISTENT
    if (iand(batch%request, PILUM_REQ_ELASTIC) /= 0) tangent = TANGENT_ELASTIC
    is_null = .not. (c_associated(batch%gradient0%p) .and. c_associated(batch%gradient1%p) .and. &
      c_associated(batch%flux0%p) .and. c_associated(batch%flux1%p))
    if (m > 0) is_null = is_null .or. .not. c_associated(batch%state0%p) .or. &
      .not. c_associated(batch%state1%p)
    if (tangent /= TANGENT_NONE) is_null = is_null .or. .not. c_associated(batch%tangent%p)
    if (is_null .and. batch%n_points > 0) then
      call say(batch%message, batch%message_capacity, 'a view that is needed is null')
      worst = PILUM_E_ARGUMENT
      return
    end if
    nullify (step_factors)
    if (c_associated(batch%step_factor)) &
      call c_f_pointer(batch%step_factor, step_factors, [batch%n_points])
    do i = 0, batch%n_points - 1
      point%n = n
      point%n_states = m
      point%gradient = 0
      point%increment = 0
      point%flux = 0
      are_finite = .true.
      do c = 1, n
        point%gradient(c) = element(batch%gradient0%p, batch%gradient0%point, batch%gradient0%component, i, c)
        point%increment(c) = element(batch%gradient1%p, batch%gradient1%point, batch%gradient1%component, i, c) &
          - point%gradient(c)
        point%flux(c) = element(batch%flux0%p, batch%flux0%point, batch%flux0%component, i, c)
        are_finite = are_finite .and. is_finite(point%gradient(c)) .and. &
          is_finite(point%increment(c)) .and. is_finite(point%flux(c))
      end do
      do c = 1, m
        point%state(c) = element(batch%state0%p, batch%state0%point, batch%state0%component, i, c)
        are_finite = are_finite .and. is_finite(point%state(c))
      end do
      point%time = batch%time
      point%time_increment = batch%time_increment
      point%step_time = batch%step_time
      call clear(point, end)
      if (are_finite) then
        status = PILUM_OK
        call instance%update(instance%p(:instance%n_parameters), point, tangent, end, status)
      else
        end%reason = 'an input is not finite'
        status = PILUM_E_NUMERIC
      end if
      if (status == PILUM_OK .or. status == PILUM_OK_UNRELIABLE) then
        do c = 1, n
          call put(batch%flux1, i, c, end%flux(c), are_finite)
        end do
        do c = 1, m
          call put(batch%state1, i, c, end%state(c), are_finite)
        end do
        if (tangent /= TANGENT_NONE) then
          ! Row by row, where Fortran stores columns.
          do row = 1, n
            do c = 1, n
              call put(batch%tangent, i, (row - 1)*n + c, end%tangent(row, c), are_finite)
            end do
          end do
        end if
        if (.not. are_finite) then
          end%reason = 'a result is not finite'
          status = PILUM_E_NUMERIC
        end if
      end if
      if (status == PILUM_CUT_STEP .and. associated(step_factors)) &
        step_factors(i + 1) = end%step_factor
      call tell(batch, i, status, end%reason, worst)
      if (status == PILUM_E_INTERNAL) exit
    end do
  end function

  ! Tells the outcome of point i; `worst` is the most severe one. A defect of the law is the outcome
  ! of all points from there on.
  subroutine tell(batch, i, status, reason, worst)
    type(pilum_batch), intent(in) :: batch
    integer(c_int64_t), intent(in) :: i
    integer(c_int32_t), intent(in) :: status
    character(len=*), intent(in) :: reason
    integer(c_int32_t), intent(inout) :: worst
    integer(c_int32_t), pointer :: statuses(:)
    if (c_associated(batch%status)) then
      call c_f_pointer(batch%status, statuses, [batch%n_points])
      statuses(i + 1) = status
      if (status == PILUM_E_INTERNAL) statuses(i + 1:) = status
    end if
    if (.not. is_worse(status, worst)) return
    worst = status
    call point_says(batch, i, reason)
  end subroutine

  ! Writes component c of point i, and notes if it is not finite.
  subroutine put(view, i, c, x, are_finite)
    type(pilum_view_mut), intent(in) :: view
    integer(c_int64_t), intent(in) :: i
    integer, intent(in) :: c
    real(dp), intent(in) :: x
    logical, intent(inout) :: are_finite
    real(dp), pointer :: at
    call locate(view%p, view%point, view%component, i, c, at)
    at = x
    are_finite = are_finite .and. is_finite(x)
  end subroutine

  ! Whether `a` is a more severe outcome than `b`.
  logical function is_worse(a, b)
    integer(c_int32_t), intent(in) :: a, b
    is_worse = merge(a < b, a > b, a < 0 .or. b < 0)
  end function

  ! Whether a parameter was left out. By its bits, so that no compiler option can have it otherwise.
  logical function is_nan(x)
    real(dp), intent(in) :: x
    integer(c_int64_t) :: bits
    bits = iand(transfer(x, bits), huge(bits))
    is_nan = bits > INFINITY_BITS
  end function

  logical function is_finite(x)
    real(dp), intent(in) :: x
    is_finite = abs(x) <= huge(x)
  end function

  ! Component c (from 1) of point i (from 0) of a view; strides count doubles and may be negative.
  real(dp) function element(p, point, component, i, c)
    type(c_ptr), intent(in) :: p
    integer(c_intptr_t), intent(in) :: point, component
    integer(c_int64_t), intent(in) :: i
    integer, intent(in) :: c
    real(dp), pointer :: at
    call locate(p, point, component, i, c, at)
    element = at
  end function

  subroutine locate(p, point, component, i, c, at)
    type(c_ptr), intent(in) :: p
    integer(c_intptr_t), intent(in) :: point, component
    integer(c_int64_t), intent(in) :: i
    integer, intent(in) :: c
    real(dp), pointer, intent(out) :: at
    integer(c_intptr_t) :: address
    address = transfer(p, address) + 8*(i*point + (c - 1)*component)
    call c_f_pointer(transfer(address, c_null_ptr), at)
  end subroutine

  ! ---- texts, without the I/O of Fortran, which allocates ----------------------------------------

  ! Keeps a text, NUL-terminated, for the life of the process.
  type(c_ptr) function text(given)
    character(len=*), intent(in) :: given
    integer :: i, start
    if (n_texts + len(given) + 1 > size(texts)) then
      call exceed('more text than there is room for')
      text = c_loc(texts(n_texts))
      return
    end if
    start = n_texts + 1
    do i = 1, len(given)
      texts(n_texts + i) = given(i:i)
    end do
    n_texts = n_texts + len(given) + 1
    texts(n_texts) = c_null_char
    text = c_loc(texts(start))
  end function

  ! The kept text at an address.
  function name_of(p) result(name)
    type(c_ptr), intent(in) :: p
    character(len=:), allocatable :: name
    character(kind=c_char), pointer :: letters(:)
    integer :: n, i
    call c_f_pointer(p, letters, [size(texts)])
    n = 0
    do while (letters(n + 1) /= c_null_char)
      n = n + 1
    end do
    allocate (character(len=n) :: name)
    do i = 1, n
      name(i:i) = letters(i)
    end do
  end function

  ! Writes a message, cut short to the buffer, which may be null.
  subroutine say(message, capacity, given)
    type(c_ptr), intent(in) :: message
    integer(c_size_t), intent(in) :: capacity
    character(len=*), intent(in) :: given
    character(kind=c_char), pointer :: buffer(:)
    integer :: i, n
    if (.not. c_associated(message) .or. capacity < 1) return
    call c_f_pointer(message, buffer, [capacity])
    n = int(min(int(len(given), c_size_t), capacity - 1))
    do i = 1, n
      buffer(i) = given(i:i)
    end do
    buffer(n + 1) = c_null_char
  end subroutine

  ! Writes `point <number>: <reason>`.
  subroutine point_says(batch, i, reason)
    type(pilum_batch), intent(in) :: batch
    integer(c_int64_t), intent(in) :: i
    character(len=*), intent(in) :: reason
    character(len=20) :: digits
    character(len=160) :: line
    integer(c_int64_t) :: rest
    integer :: k, n
    rest = batch%first_point + i
    k = len(digits) + 1
    do
      k = k - 1
      digits(k:k) = achar(iachar('0') + int(mod(rest, 10_c_int64_t)))
      rest = rest/10
      if (rest == 0) exit
    end do
    ! Piece by piece: a concatenation of unknown length would be allocated.
    n = len(digits) - k + 1
    line(:6) = 'point '
    line(7:6 + n) = digits(k:)
    line(7 + n:8 + n) = ': '
    line(9 + n:) = reason
    call say(batch%message, batch%message_capacity, line(:len_trim(line)))
  end subroutine
end module
