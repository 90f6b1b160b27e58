! Modified Cam-clay in Fortran; README.md of this folder has the equations. Inside, compression is
! positive.
module cam_clay
  use pilum
  implicit none

  integer, parameter :: PRECONSOLIDATION_PRESSURE = 1, VOID_RATIO = 2, N_STATES = 2
  ! Parameters.
  integer, parameter :: LAMBDA = 1, KAPPA = 2, M_CRITICAL = 3, E_0 = 4, SHEAR = 5, NU = 6, G_0 = 7, &
    OCR = 8

contains

  subroutine describe()
    call describe_law(id='cam_clay_fortran', name='modified Cam-clay in Fortran', &
      version='0.1.0', author='The Pilum authors', licence='MIT OR Apache-2.0', &
      doc='Elliptic yield surface, associated flow, volumetric hardening; swelling at a '// &
      'stiffness that grows with the mean stress.', references= &
      'Roscoe & Burland, On the generalized stress-strain behaviour of wet clay, 1968', &
      prepare=prepare, update=update, initial=initial)
    call add_parameter('compression_index', 'lambda', '-', &
      'Slope of the normal compression line, void ratio over ln p.', &
      above=0.0_dp, usual=[0.05_dp, 0.5_dp])
    call add_parameter('swelling_index', 'kappa', '-', &
      'Slope of the swelling line, void ratio over ln p.', above=0.0_dp, usual=[0.005_dp, 0.04_dp])
    call add_parameter('stress_ratio', 'M', '-', 'Ratio q / p at critical state.', &
      above=0.0_dp, usual=[0.6_dp, 1.5_dp])
    call add_parameter('void_ratio', 'e_0', '-', 'Void ratio at the start.', &
      above=0.0_dp, usual=[0.4_dp, 2.0_dp])
    call add_parameter('shear', '-', '-', 'What the elastic shear stiffness follows from.', &
      choices=['poisson_ratio', 'shear_modulus'], default=0.0_dp)
    call add_parameter('poisson_ratio', 'nu', '-', &
      'Poisson''s ratio, for the choice of that name.', lower=0.0_dp, below=0.5_dp, default=0.3_dp)
    call add_parameter('shear_modulus', 'G', 'kPa', &
      'Elastic shear modulus, needed for the choice of that name.', &
      above=0.0_dp, usual=[1e3_dp, 1e5_dp], optional=.true.)
    call add_parameter('overconsolidation_ratio', 'OCR', '-', &
      'Size of the yield surface at the start over that of the one through the initial stress; '// &
      'normally consolidated if left out.', &
      lower=1.0_dp, usual=[1.0_dp, 10.0_dp], optional=.true.)
    call add_state(PRECONSOLIDATION_PRESSURE, 'preconsolidation_pressure', 'p_c', 'kPa', &
      'Mean stress at which the yield surface ends.')
    call add_state(VOID_RATIO, 'void_ratio', 'e', '-', 'Void ratio.', output_only=.true.)
    call add_formulation(PILUM_H_PLANE_STRAIN, N_STATES)
    call add_formulation(PILUM_H_AXISYMMETRIC, N_STATES)
    call add_formulation(PILUM_H_3D, N_STATES)
  end subroutine

  subroutine prepare(p, refusal)
    real(dp), intent(inout) :: p(:)
    character(len=*), intent(inout) :: refusal
    if (p(KAPPA) >= p(LAMBDA)) then
      refusal = 'swelling_index: it is not below compression_index'
    else if (p(SHEAR) > 0.5_dp .and. is_nan(p(G_0))) then
      refusal = 'shear_modulus: the choice `shear_modulus` needs it'
    end if
    if (is_nan(p(OCR))) p(OCR) = 1
  end subroutine

  subroutine initial(p, flux, state, reason, status)
    real(dp), intent(in) :: p(:), flux(:)
    real(dp), intent(inout) :: state(:)
    character(len=*), intent(inout) :: reason
    integer(c_int32_t), intent(inout) :: status
    real(dp) :: pressure, q
    pressure = mean(flux)
    if (pressure <= 0) then
      reason = 'the initial mean stress is not compressive'
      status = PILUM_E_DOMAIN
      return
    end if
    ! Eq. (6).
    q = deviatoric(flux)
    state(PRECONSOLIDATION_PRESSURE) = p(OCR)*(pressure + q*q/(p(M_CRITICAL)**2*pressure))
    state(VOID_RATIO) = p(E_0)
  end subroutine

  subroutine update(p, point, tangent, end, status)
    real(dp), intent(in) :: p(:)
    type(point_type), intent(in) :: point
    integer, intent(in) :: tangent
    type(response_type), intent(inout) :: end
    integer(c_int32_t), intent(inout) :: status
    real(dp) :: bulk, g
    integer :: i
    call carry(p, point, tangent, end, status)
    if (status /= PILUM_OK) return
    if (tangent == TANGENT_CONSISTENT) then
      ! Stiffness changes over a strain of kappa / (1 + e_0).
      call differentiate(p, point, carry, p(KAPPA)/(1 + p(E_0)), end, status)
    else if (tangent == TANGENT_ELASTIC) then
      bulk = (1 + p(E_0))*mean(end%flux)/p(KAPPA)
      g = shear_stiffness(p, mean(end%flux))
      end%tangent(1:3, 1:3) = bulk - 2*g/3
      do i = 1, point%n
        end%tangent(i, i) = end%tangent(i, i) + merge(2*g, g, i <= 3)
      end do
    end if
  end subroutine

  ! The update without a tangent.
  subroutine carry(p, point, tangent, end, status)
    real(dp), intent(in) :: p(:)
    type(point_type), intent(in) :: point
    integer, intent(in) :: tangent
    type(response_type), intent(inout) :: end
    integer(c_int32_t), intent(inout) :: status
    real(dp) :: start, p_c, compression, v, g, pressure, q, ratio, deviator(MAX_COMPONENTS)
    start = mean(point%flux)
    p_c = point%state(PRECONSOLIDATION_PRESSURE)
    if (start <= 0 .or. p_c <= 0) then
      end%reason = 'the mean stress is not compressive'
      status = PILUM_E_DOMAIN
      return
    end if
    v = 1 + p(E_0)
    compression = -sum(point%increment(1:3))
    if (abs(compression)*v/p(KAPPA) > 5) then
      end%reason = 'the volume changes too much in one increment'
      end%step_factor = 2*p(KAPPA)/(v*abs(compression))
      status = PILUM_CUT_STEP
      return
    end if
    ! Eq. (1), (2): the trial stress.
    g = shear_stiffness(p, start)
    pressure = start*exp(v/p(KAPPA)*compression)
    deviator(1:3) = point%flux(1:3) + start + 2*g*(point%increment(1:3) + compression/3)
    deviator(4:6) = point%flux(4:6) + g*point%increment(4:6)
    q = sqrt(1.5_dp*sum(deviator(1:3)**2) + 3*sum(deviator(4:6)**2))
    ! Eq. (3), with what round-off leaves of a point on the surface.
    ratio = 1
    if (yield(p, pressure, q, p_c) > 1e-13_dp*p_c*p_c) call flow(p, g, q, pressure, p_c, ratio)
    end%flux = ratio*deviator
    end%flux(1:3) = end%flux(1:3) - pressure
    end%state(PRECONSOLIDATION_PRESSURE) = p_c
    end%state(VOID_RATIO) = p(E_0) + v*sum(point%gradient(1:3) + point%increment(1:3))
  end subroutine

  ! Mean stress, compression positive.
  real(dp) function mean(flux)
    real(dp), intent(in) :: flux(:)
    mean = -sum(flux(1:3))/3
  end function

  ! Deviatoric stress.
  real(dp) function deviatoric(flux)
    real(dp), intent(in) :: flux(:)
    deviatoric = sqrt(1.5_dp*sum((flux(1:3) + mean(flux))**2) + 3*sum(flux(4:6)**2))
  end function

  real(dp) function shear_stiffness(p, pressure)
    real(dp), intent(in) :: p(:), pressure
    if (p(SHEAR) > 0.5_dp) then
      shear_stiffness = p(G_0)
    else
      shear_stiffness = 1.5_dp*(1 + p(E_0))*pressure/p(KAPPA)*(1 - 2*p(NU))/(1 + p(NU))
    end if
  end function

  ! Eq. (3).
  real(dp) function yield(p, pressure, q, p_c)
    real(dp), intent(in) :: p(:), pressure, q, p_c
    yield = q*q/p(M_CRITICAL)**2 + pressure*(pressure - p_c)
  end function

  ! Carries pressure and p_c from the trial state onto the yield surface; ratio = q / q_trial. The one
  ! unknown is the plastic volumetric strain as the part y of the one that leads to the critical state,
  ! Eq. (7); f(0) > 0 > f(1), and the root is found by Newton's method between bounds.
  subroutine flow(p, g, q_trial, pressure, p_c, ratio)
    real(dp), intent(in) :: p(:), g, q_trial
    real(dp), intent(inout) :: pressure, p_c, ratio
    real(dp) :: v, soft, hard, c, x, critical, below, above, y, left, d, d_slope, q, f, by_q, slope, &
      next
    integer :: i
    v = 1 + p(E_0)
    soft = v/p(KAPPA)
    hard = v/(p(LAMBDA) - p(KAPPA))
    c = 6*g/p(M_CRITICAL)**2
    x = log(2*pressure/p_c)/(soft + hard)
    critical = pressure*exp(-soft*x)
    below = 0
    above = 1
    y = 0.5_dp
    do i = 1, 200
      left = x*(1 - y)
      pressure = critical*exp(soft*left)
      p_c = 2*critical*exp(-hard*left)
      ! d = (2 p - p_c) / x, also where x vanishes.
      if (abs(left) > 1e-9_dp) then
        d = 2*critical*(less_one(soft*left) - less_one(-hard*left))/x
      else
        d = 2*critical*(soft + hard)*(1 - y)
      end if
      d_slope = -(2*soft*pressure + hard*p_c)
      ratio = d/(d + c*y)
      q = q_trial*ratio
      f = yield(p, pressure, q, p_c)
      if (f > 0) then
        below = y
      else
        above = y
      end if
      by_q = q_trial*(d_slope*c*y - d*c)/(d + c*y)**2
      slope = 2*q/p(M_CRITICAL)**2*by_q - soft*x*pressure*(2*pressure - p_c) - hard*x*pressure*p_c
      next = y - f/slope
      if (.not. (next > below .and. next < above)) next = 0.5_dp*(below + above)
      if (abs(next - y) <= 1e-16_dp .or. above - below <= 1e-16_dp) exit
      y = next
    end do
  end subroutine

  ! exp(a) - 1, also for small a, where it is (exp(a) + 1) tanh(a/2).
  real(dp) function less_one(a)
    real(dp), intent(in) :: a
    less_one = (exp(a) + 1)*tanh(a/2)
  end function
end module

function pilum_entry(host) result(library) bind(C, name='pilum_entry')
  use cam_clay
  implicit none
  type(c_ptr), value :: host
  type(c_ptr) :: library
  if (.not. described()) call describe()
  library = the_library()
end function
